"""Writes docs/BENCHMARKS.md, its charts and docs/benchmarks.csv from the results of bench.py. Normally run by `make bench-report`.

The page has a short table for each method; the CSV has every number.
"""

import argparse
import csv
import json
import pathlib
import re

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402

LABELS = {"pyramid": "pyramid", "cp16": "cp", "cp32": "cp", "tucker-tolerance": "tucker", "pca-tolerance": "pca"}
PAGE = """# Measurements

Written by `make bench-report`; do not edit. Every number is in [benchmarks.csv](benchmarks.csv).

## What the numbers mean

{machine}
Maps are {size}^2 texels unless a line says otherwise, made by glint-synth and stored as 8-bit PNG (arguments:
`tests/bench/bench.py`).

- **Time** of a command is the time of its whole process, reading and writing files included, {repeats}.
  Time of a query is of one thread. *Random* queries ask footprints of every size anywhere, so that most miss the caches;
  *warm* queries are the same one again and again.
- **Error** is |D' - D| / |D| over the pixels of an NDF image: D' as the asset answers, D by brute force over the texels.
  *At centres*, the footprints are the ones that the asset stores. *At random*, they lie anywhere and have any size of an
  octave, so that the asset has to interpolate.
- **Target** is the figure that this project aims for. Missed targets are listed below each table.
- **Paper** is the figure of the method's paper, on its authors' machine and maps.
- A span, such as 1 to 3 s, is over the maps unless the text above the table says otherwise.
"""


def query_lines(kind):
    """Lines of the table of an asset kind that answers densities: what it says, and the figures it spans."""
    asked = {"density": "density", "mean": "mean over a range", "sample": "half vector drawn"}
    return [*((f"{words}, {how}", rf"{what}, {how}, \S+ {kind}") for what, words in asked.items() for how in ("random", "warm")),
            ("density in a batch over alone, random", rf"density, random, in a batch over alone, \S+ {kind}"),
            ("density over plain GGX, warm", rf"density, warm over plain GGX, \S+ {kind}"),
            ("error at centres, worst octave", rf"rel_l2 at centres, worst octave, \S+ {kind}"),
            ("error at random, worst octave", rf"rel_l2 at random, worst octave, \S+ {kind}")]


# Methods: title, rows "section: figure" that belong to it (the first that fits counts), what it is, and lines of its table.
METHODS = [
    ("Pyramid", r"pyramids: .*|(queries|accuracy): .* pyramid\b.*", "NDF images at every footprint size, by glint-pyramid.",
     [("build, flat facets", r"pyramid, flat, .*"), ("build, smooth surface", r"pyramid, smooth, .*"), ("peak memory", r"peak memory of the pyramids"),
      *query_lines("pyramid")]),
    ("Compressed pyramid: CP", r"compressions: (?!.*\b(tucker|pca)\b).*|(queries|accuracy): .* cp\d+\b.*|query_command: .*",
     "Canonical polyadic decomposition of the pyramid's blocks, by glint-compress: 16 columns, flakes 32.",
     [("build", r"compress, cp .*"), ("bytes", r"bytes, cp .*"), *query_lines(r"cp\d+")]),
    ("Compressed pyramid: Tucker", r"(compressions|queries|accuracy): .*\btucker\b.*", "Tucker-2 of the pyramid's blocks, to the error of CP.",
     [("build", r"compress, tucker .*"), ("bytes over those of CP", r"bytes over those of .*, tucker, .*"), *query_lines("tucker-tolerance")]),
    ("Compressed pyramid: PCA", r"(compressions|queries|accuracy): .*\bpca\b.*", "Principal components of the pyramid's blocks, to the error of CP.",
     [("build", r"compress, pca .*"), ("bytes over those of CP", r"bytes over those of .*, pca, .*"), *query_lines("pca-tolerance")]),
    ("Bin map", r"bin_maps: .*", "Texels sorted by direction, by glint-binmap; 21 weights are one query. Spans are over maps and roughnesses.",
     [("build, 2K maps", r"bin map, build, .* 2K.*"), ("bytes, 2K maps", r"bin map, bytes, .* 2K.*"),
      *((f"weights of {side}^2 texels", rf"bin map, weights, .*, {side}\^2") for side in (4, 64, 1024)),
      *((f"density of {side}^2 texels", rf"bin map, density, .*, {side}\^2") for side in (4, 64, 1024)),
      *((f"density of {side}^2 texels, as published", rf"bin map, published density, .*, {side}\^2") for side in (4, 64, 1024)),
      ("median error", r"bin map, median error, .*"), ("median error, as published", r"bin map, median error as published, .*"), ("energy", r"bin map, energy, .*")]),
    ("Texels", r"below_level_0: .*", "Footprints of a deviation of .5 to 8 texels, answered from the texels by `ManifoldNdf`, beside `Reference` in one run. Spans are over maps and sizes.",
     [line for surface in ("smooth", "flat") for shape in ("round", "box") for line in (
         (f"density, {surface}, {shape} footprints", rf"from texels, density, random, .*, {surface}, {shape}, .*"),
         (f"mean over a range, {surface}, {shape} footprints", rf"from texels, mean, .*, {surface}, {shape}, .*"),
         (f"time over that of Reference, {surface}, {shape} footprints", rf"from texels over Reference, .*, {surface}, {shape}, .*"),
         (f"error, {surface}, {shape} footprints", rf"from texels, error, .*, {surface}, {shape}, .*"))]),
    ("Moments", r"moments: .*|queries: .* moments\b.*", "Moments of slopes, by glint-moments: one lobe for each footprint. What pictures of them lack is in [LIMITS](LIMITS.md).",
     [("build", r"moments, \S+"), ("bytes", r"bytes of moments, .*"), *query_lines("moments")[:-2]]),
    ("Histograms", r"histograms: .*", "Accumulated histograms of 9 x 32 directions, by glint-sat.",
     [*((f"{what}, stride {stride}", rf"{figure}, stride {stride}, .*") for stride in (4, 16)
        for what, figure in (("build", "histograms"), ("bytes", "bytes of histograms"), ("histogram of 64^2 texels", r"histogram of 64\^2"),
                             ("histogram of 1024^2 texels", r"histogram of 1024\^2"))),
      ("variation of turned boxes from exact", r"mean variation of .*")]),
    ("Light", r"light: .*", "Tables of spherical harmonics, by glint-shlobes, and the light that a histogram of 24 normals reflects.",
     [("build, lobes", r"SH lobes, .*"), ("build, light, 65 x 128 directions", r"SH light, .*, 65x128"), ("error, order 60", r"light, error, .*, order 60"),
      ("product integral, order 60", r"light, product integral, .*, order 60"),
      ("Monte Carlo at the same error", r"light, Monte Carlo at equal error, .*, order 60")]),
    ("Displacement", r"displacements: .*", "Downsampled displacement maps, by glint-displace; the span is over bases.",
     [("build, factor 16, 1024^2", r"displace, factor 16, .*, 1024\^2"), ("build, factor 16, 4096^2", r"displace, factor 16, .*, 4096\^2"),
      ("peak memory", r"peak memory, displace .*"), ("bytes of T and S", r"bytes of T and S.*"), ("reflected light, warm", r"light reflected by .*")]),
    ("Maps, and a plain model", r".*", "Synthesis, ingest, and a plain microfacet model (GGX) for comparison.",
     [("synthesis", r"synth .*"), ("ingest", r"ingest .*"),
      ("GGX, density, warm", r"density, warm, \S+ ggx"), ("GGX, half vector drawn, warm", r"sample, warm, \S+ ggx")]),
]


def cannot_hold(row):
    """Why the row's target cannot hold for its kind of asset; nothing if it can."""
    return row.get("cannot_hold", "")


def judged(rows):
    """Rows whose targets can hold."""
    return [row for row in rows if row["target"] is not None and not cannot_hold(row)]


def missed(rows):
    return [row for row in judged(rows) if row["value"] > row["target"]]


def digits(value):
    """Three digits, without an exponent where the number is large."""
    return f"{value:.3g}" if abs(value) < 1000 else f"{float(f'{value:.3g}'):,.0f}"


def span(values, unit):
    """The value, or the least and the greatest of several."""
    low, high = digits(min(values)), digits(max(values))
    return f"{low if low == high else f'{low} to {high}'} {unit}".strip()


def limits(rows):
    return "<= " + span([row["target"] for row in rows], rows[0]["unit"])


def verdict(rows):
    """The target of a line and whether its rows meet it."""
    held = judged(rows)
    if not held:
        return "cannot hold" if any(map(cannot_hold, rows)) else ""
    over = len(missed(rows))
    return f"{limits(held)}: {'met' if over == 0 else f'**{over} of {len(held)} missed**'}"


def method_table(rows, lines):
    """A line for each summary of figures that were measured."""
    text = ["| figure | measured | target | paper |", "|---|---|---|---|"]
    for label, pattern in lines:
        if found := [row for row in rows if re.fullmatch(pattern, row["figure"])]:
            papers = "; ".join(dict.fromkeys(row["paper"] for row in found if row["paper"])) if len(found) < 8 else ""
            text.append(f"| {label} | {span([row['value'] for row in found], found[0]['unit'])} | {verdict(found)} | {papers} |")
    return "\n".join(text)


def folded(title, lines):
    return f"\n<details><summary>{title}</summary>\n\n" + "\n".join(lines) + "\n\n</details>\n" if lines else ""


def target_notes(rows):
    """Targets that cannot hold for the method, and a folded list of the missed ones."""
    text = ""
    for reason in dict.fromkeys(filter(None, map(cannot_hold, rows))):
        group = [row for row in rows if cannot_hold(row) == reason]
        figures = ", ".join(dict.fromkeys(f"*{row['figure'].rpartition(', ')[0]}*" for row in group))
        text += f"\nCannot hold here ({limits(group)}; measured {span([row['value'] for row in group], group[0]['unit'])}): {figures}. {reason}\n"
    over = missed(rows)
    return text + folded(f"{len(over)} of {len(judged(rows))} targets missed",
                         [f"- {row['figure']}: {span([row['value']], row['unit'])}, target {limits([row])}" for row in over])


def method_sections(rows, charts):
    """A section for each method that was measured, with its charts."""
    text, rest = "", rows
    for title, belongs, what, lines in METHODS:
        own = [row for row in rest if re.fullmatch(belongs, f"{row['section']}: {row['figure']}")]
        rest = [row for row in rest if row not in own]
        if own:
            text += f"\n## {title}\n\n{what}\n\n{method_table(own, lines)}\n{target_notes(own)}{charts.get(title, '')}"
    return text


def octave_rows(accuracy):
    """Errors of every octave as rows of the CSV."""
    for name, assets in accuracy.items():
        for asset in assets:
            for level in asset["levels"]:
                for place in ("centres", "random"):
                    for figure, value in level.get(place, {}).items():
                        yield {"section": "octaves", "value": value, "unit": "",
                               "figure": f"{figure} at {place}, {level['sigma_texels']:.0f} texels, {name} {kind_of(asset['asset'], name)}"}


def light_rows(light):
    """Errors of light for every roughness and order as rows of the CSV."""
    for row in light.get("errors_by_order", []):
        figure = f"light, error, {row['light']}, roughness {row['sigma_r']:.2g}, order {row['order']}"
        yield {"section": "light by order", "figure": figure, "value": row["none"], "unit": ""}


def write_csv(rows, path):
    """Every number, a line each."""
    with open(path, "w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, ["section", "figure", "value", "unit", "target", "cannot_hold", "paper", "design", "details"], extrasaction="ignore",
                                lineterminator="\n")
        writer.writeheader()
        for row in rows:
            details = {name: value for name, value in row.get("details", {}).items() if isinstance(value, (int, float))}
            writer.writerow(row | {"value": f"{row['value']:.6g}", "details": "; ".join(f"{name} {value:.6g}" for name, value in details.items())})


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


def overview(data, rows, docs):
    """Charts of error against bytes and time of every kind that answers densities."""
    chart(data, 0, "MB", docs / "error-bytes.png")
    chart(data, 2, "nanoseconds of a density query, random", docs / "error-time.png")
    held, excused = judged(rows), sum(1 for row in rows if cannot_hold(row))
    return f"""
Every point is an asset: its error against its bytes, and against the time of a query. Down and to the left is better.
{len(held) - len(missed(rows))} of {len(held)} targets are met; {excused} more cannot hold for their kind of asset, as its section says.

![Error against bytes](error-bytes.png)
![Error against time](error-time.png)
"""


def method_charts(rows, light, docs):
    """Charts that stand below the tables of methods."""
    charts = {}
    if any(row["figure"].startswith("bytes of histograms") for row in rows):
        name = stride_chart(rows, docs / "histogram-stride.png")
        charts["Histograms"] = f"\nBytes against time, for boxes along the axes anywhere on the map:\n\n![Bytes against time]({name})\n"
    if light:
        error, time = light_error_chart(light, docs / "light-error.png"), light_time_chart(light, docs / "light-time.png")
        charts["Light"] = f"""
Errors are against quadrature over the lobes of all normals: under constant light, a spot of 5 degrees in darkness, and a studio with a sun of 1.5 degrees,
1500 times the sky, a window and stripes. All three are synthesised; none is a photograph. Errors are RMS over 16 outgoing directions and three colours, at
17x32 directions (times: 9x16, the nearest). Monte Carlo draws half vectors from the lobes.

![Error against order]({error})
![Time against error]({time})
"""
    return charts


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("results", type=pathlib.Path)
    parser.add_argument("--docs", type=pathlib.Path, default="docs")
    arguments = parser.parse_args()
    folder, docs = arguments.results.parent, arguments.docs
    results = json.loads(arguments.results.read_text())
    rows = results["rows"]
    accuracy = {path.name.split(".")[0]: json.loads(path.read_text()) for path in sorted(folder.glob("*.accuracy.json"))}
    light = json.loads((folder / "light.json").read_text()) if (folder / "light.json").exists() else {}
    docs.mkdir(exist_ok=True)
    machine = "{processor}, {cores} cores; load {load:.1f} before the run; revision {revision}.".format(**results["machine"])
    repeats = f"the median of {results['repeats']} runs" if results["repeats"] > 1 else "of one run"
    text = PAGE.format(machine=machine, size=results["size_texels"], repeats=repeats)
    if data := points(accuracy, rows):
        text += overview(data, rows, docs)
    text += method_sections(rows, method_charts(rows, light, docs))
    (docs / "BENCHMARKS.md").write_text(text, encoding="utf-8")
    write_csv([*rows, *octave_rows(accuracy), *light_rows(light)], docs / "benchmarks.csv")
    print(f"wrote {docs}/BENCHMARKS.md, its charts and benchmarks.csv")


if __name__ == "__main__":
    main()
