"""Writes docs/BENCHMARKS.md and its charts from the results of bench.py. Normally run by `make bench-report`."""

import argparse
import json
import pathlib
import re

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402

LABELS = {"pyramid": "pyramid", "cp16": "cp", "cp32": "cp", "tucker-tolerance": "tucker", "pca-tolerance": "pca"}
# Sections of bench.py -> headings.
SECTIONS = {"synth_and_ingest": "Synthesis and ingest", "pyramids": "Pyramids", "compressions": "Compression", "queries": "Queries",
            "query_command": "glint-query", "displacements": "Displacements", "histograms": "Histograms", "light": "Light", "bin_maps": "Bin maps",
            "accuracy": "Accuracy"}
HEADER = """# Measurements

Written by `make bench-report`; do not edit. Repeat with `make bench`, which prints the same figures and writes
`build/bench/results.json`.

{machine}
Maps are {size}^2 texels, made by glint-synth and stored as 8-bit PNG (arguments: `tests/bench/bench.py`). Times are of whole
processes, reading and writing files included, {repeats}. Papers' figures are their own, on their machines (Deng
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


def section_tables(rows):
    """A table for each section of bench.py, and before them one of how many targets each meets."""
    sections = {title: [row for row in rows if row["section"] == name] for name, title in SECTIONS.items()}
    sections = {title: found for title, found in sections.items() if found}
    lines = ["| section | figures | with a target | over it |", "|---|---|---|---|"]
    for title, found in sections.items():
        targets = [row for row in found if row["target"] is not None]
        over = sum(row["value"] > row["target"] for row in targets)
        anchor = "".join(c for c in title.lower() if c.isalnum() or c in " -").replace(" ", "-")
        lines.append(f"| [{title}](#{anchor}) | {len(found)} | {len(targets)} | {over} |")
    return "\n".join(lines) + "\n" + "".join(f"\n## {title}\n\n{table(found)}\n" for title, found in sections.items())


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
    finish(figure, axis, path, xlabel=label, ylabel="relative L2 error, mean over octaves")


def finish(figure, axis, path, **labels):
    axis.set(xscale="log", yscale="log", **labels)
    axis.grid(True, which="both", color="0.92", linewidth=0.6)
    axis.legend(fontsize=8, frameon=False, loc="center left", bbox_to_anchor=(1, 0.5))
    figure.savefig(path, dpi=110, bbox_inches="tight", metadata={"Software": None})
    plt.close(figure)


def light_error_chart(light, path):
    """Error of the product integral against the order, for every environment and roughness of the lobes."""
    figure, axis = plt.subplots(figsize=(6, 4))
    lights = list(dict.fromkeys(row["light"] for row in light["errors_by_order"]))
    styles = dict(zip(sorted({row["sigma_r"] for row in light["errors_by_order"]}), (":", "-", "--")))
    for k, name in enumerate(lights):
        for sigma, style in styles.items():
            rows = [row for row in light["errors_by_order"] if row["light"] == name and row["sigma_r"] == sigma and row["order"] >= 5]
            axis.plot([row["order"] for row in rows], [row["none"] for row in rows], "o" + style, color=f"C{k}", markersize=4,
                      label=f"{name.replace('_', ' ')}, roughness {sigma:.2g}")
    finish(figure, axis, path, xlabel="order", ylabel="relative RMS error against quadrature")
    return path.name


def light_time_chart(light, path):
    """Time of the product integral, and of Monte Carlo for the same error."""
    figure, axis = plt.subplots(figsize=(6, 4))
    lights = list(dict.fromkeys(row["light"] for row in light["times_at_equal_error"]))
    for k, name in enumerate(lights):
        rows = [row for row in light["times_at_equal_error"] if row["light"] == name]
        errors = [row["nearest"]["error"] for row in rows]
        label = name.replace("_", " ")
        axis.plot(errors, [row["nearest"]["us"] for row in rows], "o-", color=f"C{k}", label=f"{label}, harmonics")
        axis.plot(errors, [row["nearest"]["monte_carlo_us"] for row in rows], "x--", color=f"C{k}", label=f"{label}, Monte Carlo")
        for row in rows:
            axis.annotate(f"{row['order']}", (row["nearest"]["error"], row["nearest"]["us"]), textcoords="offset points", xytext=(5, 4), fontsize=7)
    finish(figure, axis, path, xlabel="relative RMS error against quadrature", ylabel="microseconds of one shading point")
    return path.name


def stride_chart(rows, path):
    """Bytes of accumulated histograms against the time of a query, along the strides of their tables."""
    figure, axis = plt.subplots(figsize=(6, 4))
    values = {row["figure"]: row["value"] for row in rows}
    strides = {int(match[1]) for figure_name in values if (match := re.fullmatch(r"bytes of histograms, stride (\d+), \S+", figure_name))}
    names = sorted({figure_name.split(", ")[2] for figure_name in values if figure_name.startswith("bytes of histograms")})
    for k, name in enumerate(names):
        for size, style in ((64, "o:"), (256, "s-"), (1024, "^--")):
            points = [(values[f"bytes of histograms, stride {s}, {name}"], values[f"histogram of {size}^2, stride {s}, {name}"], s) for s in sorted(strides)]
            axis.plot([p[0] for p in points], [p[1] for p in points], style, color=f"C{k}", markersize=5, label=f"{name}, {size}$^2$ texels")
            if size == 256:
                for megabytes, us, stride in points:
                    axis.annotate(f"{stride}", (megabytes, us), textcoords="offset points", xytext=(4, 4), fontsize=7)
    finish(figure, axis, path, xlabel="MB (numbers: stride in texels)", ylabel="microseconds of a histogram")
    return path.name


def light_section(results, folder, docs):
    """Charts of histograms and of light, of what has been measured."""
    text = ""
    if any(row["figure"].startswith("bytes of histograms") for row in results["rows"]):
        chart_name = stride_chart(results["rows"], docs / "histogram-stride.png")
        text += f"\n## Histograms: bytes against time\n\nBoxes along the axes, anywhere on the map.\n\n![Bytes against time]({chart_name})\n"
    if (folder / "light.json").exists():
        light = json.loads((folder / "light.json").read_text())
        error, time = light_error_chart(light, docs / "light-error.png"), light_time_chart(light, docs / "light-time.png")
        text += f"""
## Light in spherical harmonics

The light that a histogram of 24 normals reflects, against quadrature over the lobes of all of them: under constant light, a spot of 5 degrees in darkness, and
a studio with a sun of 1.5 degrees, 1500 times the sky, a window and stripes. All three are synthesised; none is a photograph. Errors are RMS over 16
outgoing directions and three colours, at 17x32 directions (times: 9x16, the nearest). Monte Carlo draws half vectors from the lobes.

![Error against order]({error})
![Time against error]({time})
"""
    return text


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
    text = HEADER.format(machine=machine, size=results["size_texels"], repeats=f"the median of {results['repeats']} runs" if results["repeats"] > 1 else "of one run each") + "\n"
    if data:
        chart(data, 0, "MB", arguments.docs / "error-bytes.png")
        chart(data, 2, "nanoseconds of a density query, random", arguments.docs / "error-time.png")
        text += "\n## Error against bytes and time\n\n![Error against bytes](error-bytes.png)\n![Error against time](error-time.png)\n"
    text += light_section(results, arguments.results.parent, arguments.docs)
    text += f"\n## Targets\n\n{section_tables(results['rows'])}"
    if data:
        text += f"\n## Errors of every octave\n\nAgainst brute force over the texels, at footprints on the centres of a level and at random ones of its octave.\n\n{level_tables(accuracy)}"
    (arguments.docs / "BENCHMARKS.md").write_text(text.rstrip() + "\n")
    print(f"wrote {arguments.docs}/BENCHMARKS.md and its charts")


if __name__ == "__main__":
    main()
