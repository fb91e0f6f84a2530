"""Writes docs/PAPERS.md from results of glint-bench --preset: the papers' figures beside ours.

Normally run by `make papers`.
"""

import argparse
import json
import pathlib

PAGE = """# The papers' figures beside ours

Written by `make papers`; do not edit. `glint-bench --preset PAPER` makes the rows of one paper, on synthetic maps of the kind that the paper
shows, and `glint-bench --report` a page of them.

{machine}, {cores} cores. Times and bytes of the papers are of their machines (6 to 64 cores) and their maps. Where a paper prints pictures or curves
without numbers, its column is empty. "x" is ours over the paper's.
"""


def number(x):
    return "" if x is None else f"{x:,.0f}" if abs(x) >= 1000 else f"{x:.3g}"


def ratio(row):
    return f"x{row['ours'] / row['paper']:.2g}" if row.get("paper") and row.get("ours") else ""


def table(rows):
    lines = ["| of the paper | subject | figure | paper | ours | x | |", "|---|---|---|---|---|---|---|"]
    for row in rows:
        figure = f"{row['figure']}, {row['unit']}" if row["unit"] else row["figure"]
        lines.append(
            f"| {row['source']} | {row['subject']} | {figure} | {number(row.get('paper'))} | {number(row.get('ours'))} | {ratio(row)} | {row.get('note', '')} |"
        )
    return "\n".join(lines)


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("results", type=pathlib.Path, nargs="+")
    parser.add_argument("--docs", type=pathlib.Path, required=True)
    arguments = parser.parse_args()
    results = [json.loads(path.read_text()) for path in arguments.results]
    machine = results[0]["machine"]
    sections = [f"## {result['paper']}\n\n{table(result['rows'])}" for result in results]
    text = PAGE.format(machine=machine["processor"], cores=machine["cores"]) + "\n" + "\n\n".join(sections) + "\n"
    (arguments.docs / "PAPERS.md").write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
