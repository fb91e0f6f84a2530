"""Writes docs/stability.json, docs/stability.png and their section of docs/LIMITS.md from results of glint-bench --stability.

Normally run by `make stability`.
"""

import argparse
import json
import pathlib

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402
from limits_section import SHORT, series_of, with_section  # noqa: E402

COLUMNS = 3
SMALLEST = 1e-4  # figures below are drawn there
COLORS = {
    "moments": "C0",
    "bin map": "C1",
    "histograms": "C2",
    "pyramid": "C3",
    "tucker": "C4",
    "cp": "C5",
    "pyramid with --normals": "C6",
}


def draw(axes, test):
    for series in series_of(test):
        points = sorted(
            (point["x"], max(SMALLEST, point["value"]))
            for point in test["points"]
            if point["series"] == series and "value" in point
        )
        name = SHORT.get(series, series)
        axes.plot(*zip(*points), marker="o", markersize=3, linewidth=1.3, color=COLORS.get(name), label=name)
    xs = sorted({point["x"] for point in test["points"]})
    if xs[0] > 0 and xs[-1] / xs[0] >= 8 and not (xs[-1] < 1 and xs[-1] / xs[0] < 20):
        axes.set_xscale("log")
        axes.set_xticks(xs, [f"{x:g}" for x in xs])
        axes.minorticks_off()
    axes.set_yscale("log")
    axes.axhline(test["tolerable"], color="0.4", linestyle="--", linewidth=0.9)
    axes.set_title(test["title"], fontsize=10, loc="left")
    axes.set_xlabel(test["axis"], fontsize=8)
    axes.set_ylabel(test["figure"], fontsize=8)
    axes.tick_params(labelsize=7)
    axes.grid(alpha=0.25)
    axes.legend(fontsize=6.5, frameon=False)


def chart(results, path):
    tests = results["tests"]
    rows = -(-len(tests) // COLUMNS)
    figure, all_axes = plt.subplots(rows, COLUMNS, figsize=(4.6 * COLUMNS, 3.2 * rows), layout="constrained")
    for axes in all_axes.flat[len(tests) :]:
        axes.axis("off")
    for axes, test in zip(all_axes.flat, tests):
        draw(axes, test)
    figure.savefig(path, dpi=90, metadata={"Software": None})


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("results", type=pathlib.Path)
    parser.add_argument("--docs", type=pathlib.Path, required=True)
    arguments = parser.parse_args()
    results = json.loads(arguments.results.read_text())
    (arguments.docs / "stability.json").write_text(json.dumps(results, indent=1) + "\n")
    chart(results, arguments.docs / "stability.png")
    page = arguments.docs / "LIMITS.md"
    page.write_text(with_section(page.read_text(encoding="utf-8"), results), encoding="utf-8")


if __name__ == "__main__":
    main()
