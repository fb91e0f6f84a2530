"""Writes docs/BENCHMARKS.md and its charts from the results of bench.py. Normally run by `make bench-report`."""

import argparse
import json
import pathlib
import re

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402

LABELS = {"pyramid": "pyramid", "cp16": "cp", "cp32": "cp", "tucker-tolerance": "tucker", "pca-tolerance": "pca"}
HEADER = """# Measurements

Written by `make bench-report`; do not edit. Repeat with `make bench`, which prints the same figures and writes
`build/bench/results.json`.

{machine}
Maps are {size}^2 texels, made by glint-synth and stored as 8-bit PNG (arguments: `tests/bench/bench.py`). Times are of whole
processes, reading and writing files included: the median of {repeats} runs. Papers' figures are their own, on their machines (Deng
2022: 40 cores at 2.39 GHz, other maps of the same kinds); the last column is what a throw-away version of the same idea reached on a
machine like this.
"""


def number(value, unit):
    return f"{value:.4g} {unit}".strip()


def table(rows):
    lines = ["| figure | measured | target | paper | design's floor |", "|---|---|---|---|---|"]
    for row in rows:
        target = ""
        if row["target"] is not None:
            target = f"<= {number(row['target'], row['unit'])}" + ("" if row["value"] <= row["target"] else " **over**")
        lines.append(f"| {row['figure']} | {number(row['value'], row['unit'])} | {target} | {row['paper']} | {row['design']} |")
    return "\n".join(lines)


def level_tables(accuracy):
    """Errors of every octave, per map and asset."""
    lines = []
    for name, assets in accuracy.items():
        lines += [f"### {name}", "", "| asset | MB | footprint, texels | rel_l2 | tv | energy | rel_l2 at random |", "|---|---|---|---|---|---|---|"]
        for asset in assets:
            kind = kind_of(asset["asset"], name)
            for k, level in enumerate(asset["levels"]):
                c = level["centres"]
                random = f"{level['random']['rel_l2']:.4f}" if "random" in level else ""
                first = f"{kind} | {asset['size_bytes'] / 1e6:.2f}" if k == 0 else " | "
                lines.append(f"| {first} | {level['sigma_texels']:.0f} | {c['rel_l2']:.4f} | {c['tv']:.4f} | {c['energy']:+.1e} | {random} |")
        lines.append("")
    return "\n".join(lines)


def kind_of(path, name):
    return pathlib.Path(path).name.removeprefix(name + ".").removesuffix(".glint")


def mean_error(asset):
    """Mean over octaves of the error at the model's own centres."""
    return sum(level["centres"]["rel_l2"] for level in asset["levels"]) / len(asset["levels"])


def points(accuracy, rows):
    """(map, asset) -> bytes, error, nanoseconds of a random density query."""
    nanoseconds = {}
    for row in rows:
        if match := re.fullmatch(r"density, random, (\S+) (\S+)", row["figure"]):
            nanoseconds[match[1], match[2]] = row["value"]
    return {(name, kind_of(asset["asset"], name)): (asset["size_bytes"] / 1e6, mean_error(asset), nanoseconds.get((name, kind_of(asset["asset"], name))))
            for name, assets in accuracy.items() for asset in assets}


def chart(data, column, label, path):
    figure, axis = plt.subplots(figsize=(6, 4))
    markers = {"pyramid": "s", "cp": "o", "tucker": "^", "pca": "D"}
    names = sorted({name for name, _ in data})
    for (name, kind), point in data.items():
        if point[column] is None:
            continue
        axis.plot(point[column], point[1], markers[LABELS[kind]], color=f"C{names.index(name)}", markersize=7)
    for k, name in enumerate(names):
        axis.plot([], [], "-", color=f"C{k}", label=name, linewidth=4)
    for method, marker in markers.items():
        axis.plot([], [], marker, color="0.3", label=method)
    axis.set(xscale="log", yscale="log", xlabel=label, ylabel="relative L2 error, mean over octaves")
    axis.grid(True, which="both", color="0.92", linewidth=0.6)
    axis.legend(fontsize=8, frameon=False, loc="center left", bbox_to_anchor=(1, 0.5))
    figure.savefig(path, dpi=110, bbox_inches="tight", metadata={"Software": None})
    plt.close(figure)


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("results", type=pathlib.Path)
    parser.add_argument("--docs", type=pathlib.Path, default="docs")
    arguments = parser.parse_args()
    results = json.loads(arguments.results.read_text())
    accuracy = {path.name.split(".")[0]: json.loads(path.read_text()) for path in sorted(arguments.results.parent.glob("*.accuracy.json"))}
    machine = "{processor}, {cores} cores; load {load:.1f} before the run; revision {revision}.".format(**results["machine"])
    data = points(accuracy, results["rows"])
    arguments.docs.mkdir(exist_ok=True)
    chart(data, 0, "MB", arguments.docs / "error-bytes.png")
    chart(data, 2, "nanoseconds of a density query, random", arguments.docs / "error-time.png")
    text = HEADER.format(machine=machine, size=results["size_texels"], repeats=results["repeats"])
    text += f"\n{table(results['rows'])}\n\n## Error against bytes and time\n\n![Error against bytes](error-bytes.png)\n![Error against time](error-time.png)\n"
    text += f"\n## Errors of every octave\n\nAgainst brute force over the texels, at footprints on the centres of a level and at random ones of its octave.\n\n{level_tables(accuracy)}"
    (arguments.docs / "BENCHMARKS.md").write_text(text.rstrip() + "\n")
    print(f"wrote {arguments.docs}/BENCHMARKS.md, error-bytes.png and error-time.png")


if __name__ == "__main__":
    main()
