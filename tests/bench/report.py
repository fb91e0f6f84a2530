"""Writes docs/BENCHMARKS.md, its charts and docs/benchmarks.csv from the results of bench.py. Normally run by `make bench-report`.

The page answers the questions that people bring, each with one chart and one table; then come the figures of each method, folded. The CSV has every
number. What pictures show is read from docs/limits.csv, which `make limits` writes.
"""

import argparse
import csv
import json
import pathlib
import re
import sys

sys.path.insert(0, str(pathlib.Path(__file__).parents[2] / "pipelines"))
from charts import chart, light_error_chart, light_time_chart, preparation_chart, stride_chart
from machine import machine_text
from plan_calibration import calibration_section
from scenes import scene_section
from words import percents, sizes, span, times

PAGE = """# Measurements

Written by `make bench-report`; do not edit. Every number, with its target and the figure of its paper, is a line of [benchmarks.csv](benchmarks.csv).
`glint-bench map.glint -o results.json` measures the same on a map of yours, and `glint-bench --report results.json -o report.html` charts it.

- [Which method for my scene?](#which-method-for-my-scene)
{calibration}- [How right, and how quick, is an answer?](#how-right-and-how-quick-is-an-answer)
- [How small is an asset?](#how-small-is-an-asset)
- [How long does an asset take to make?](#how-long-does-an-asset-take-to-make)
- [What is not reached yet?](#what-is-not-reached-yet)
- Every method by itself: {methods}
- [How it was measured](#how-it-was-measured): read it before you quote a number
"""
CONDITIONS = """
## How it was measured

{machine}
Maps are {size}^2 texels unless a line says otherwise, made by glint-synth and stored as 8-bit PNG (arguments: `tests/bench/bench.py`). `make bench` measures,
`make bench-report` writes this page; what pictures show is measured by `make limits`, on maps of 1024^2 texels: [LIMITS](LIMITS.md) says how.

- **Time** of a command is the time of its whole process, reading and writing files included, {repeats}.
  Time of a query is of one thread. *Random* queries ask footprints of every size anywhere, so that most miss the caches;
  *warm* queries are the same one again and again.
- **Error** is |D' - D| / |D| over the pixels of an NDF image: D' as the asset answers, D by brute force over the texels.
  *At centres*, the footprints are the ones that the asset stores. *At random*, they lie anywhere and have any size of an
  octave, so that the asset has to interpolate.
- **Target** is the figure that this project aims for.
- **Paper** is the figure of the method's paper, on its authors' machine and maps.
- A span, such as 1 to 3 s, is over the maps unless the text above the table says otherwise.
"""


def query_lines(kind):
    """Lines of the table of an asset kind that answers densities: what it says, and the figures it spans."""
    asked = {"density": "density", "mean": "mean over a range", "sample": "half vector drawn"}
    return [
        *((f"{words}, {how}", rf"{what}, {how}, \S+ {kind}") for what, words in asked.items() for how in ("random", "warm")),
        ("density in a batch over alone, random", rf"density, random, in a batch over alone, \S+ {kind}"),
        ("density over plain GGX, warm", rf"density, warm over plain GGX, \S+ {kind}"),
        ("error at centres, worst octave", rf"rel_l2 at centres, worst octave, \S+ {kind}"),
        ("error at random, worst octave", rf"rel_l2 at random, worst octave, \S+ {kind}"),
    ]


# Methods: title, rows "section: figure" that belong to it (the first that fits counts), what it is, and lines of its table.
METHODS = [
    (
        "Pyramid",
        r"pyramids: .*|(queries|accuracy): .* pyramid\b.*",
        "NDF images at every footprint size, by glint-pyramid.",
        [
            ("build, flat facets", r"pyramid, flat, .*"),
            ("build, smooth surface", r"pyramid, smooth, .*"),
            ("peak memory", r"peak memory of the pyramids"),
            *query_lines("pyramid"),
        ],
    ),
    (
        "Compressed pyramid: CP",
        r"compressions: (?!.*\b(tucker|pca)\b).*|(queries|accuracy): .* cp\d+\b.*|query_command: .*",
        "Canonical polyadic decomposition of the pyramid's blocks, by glint-compress: 16 columns, flakes 32.",
        [("build", r"compress, cp .*"), ("bytes", r"bytes, cp .*"), *query_lines(r"cp\d+")],
    ),
    (
        "Compressed pyramid: Tucker",
        r"(compressions|queries|accuracy): .*\btucker\b.*",
        "Tucker-2 of the pyramid's blocks, to the error of CP.",
        [
            ("build", r"compress, tucker .*"),
            ("bytes over those of CP", r"bytes over those of .*, tucker, .*"),
            *query_lines("tucker-tolerance"),
        ],
    ),
    (
        "Compressed pyramid: PCA",
        r"(compressions|queries|accuracy): .*\bpca\b.*",
        "Principal components of the pyramid's blocks, to the error of CP.",
        [
            ("build", r"compress, pca .*"),
            ("bytes over those of CP", r"bytes over those of .*, pca, .*"),
            *query_lines("pca-tolerance"),
        ],
    ),
    (
        "Bin map",
        r"bin_maps: .*",
        "Texels sorted by direction, by glint-binmap; 21 weights are one query. Spans are over maps and roughnesses.",
        [
            ("build, 2K maps", r"bin map, build, .* 2K.*"),
            ("bytes, 2K maps", r"bin map, bytes, .* 2K.*"),
            *((f"weights of {side}^2 texels", rf"bin map, weights, .*, {side}\^2") for side in (4, 64, 1024)),
            *((f"density of {side}^2 texels", rf"bin map, density, .*, {side}\^2") for side in (4, 64, 1024)),
            *(
                (f"density of {side}^2 texels, as published", rf"bin map, published density, .*, {side}\^2")
                for side in (4, 64, 1024)
            ),
            ("median error", r"bin map, median error, .*"),
            ("median error, as published", r"bin map, median error as published, .*"),
            ("energy", r"bin map, energy, .*"),
        ],
    ),
    (
        "Texels",
        r"below_level_0: .*",
        "Footprints of a deviation of .5 to 8 texels, answered from the texels by `ManifoldNdf`, beside `Reference` in one run. Spans are over maps and sizes.",
        [
            line
            for surface in ("smooth", "flat")
            for shape in ("round", "box")
            for line in (
                (f"density, {surface}, {shape} footprints", rf"from texels, density, random, .*, {surface}, {shape}, .*"),
                (f"mean over a range, {surface}, {shape} footprints", rf"from texels, mean, .*, {surface}, {shape}, .*"),
                (
                    f"time over that of Reference, {surface}, {shape} footprints",
                    rf"from texels over Reference, .*, {surface}, {shape}, .*",
                ),
                (f"error, {surface}, {shape} footprints", rf"from texels, error, .*, {surface}, {shape}, .*"),
            )
        ],
    ),
    (
        "Moments",
        r"moments: .*|queries: .* moments\b.*",
        "Moments of slopes, by glint-moments: one lobe for each footprint. What pictures of them lack is in [LIMITS](LIMITS.md).",
        [("build", r"moments, \S+"), ("bytes", r"bytes of moments, .*"), *query_lines("moments")[:-2]],
    ),
    (
        "Histograms",
        r"histograms: .*",
        "Accumulated histograms of 9 x 32 directions, by glint-sat.",
        [
            *(
                (f"{what}, stride {stride}", rf"{figure}, stride {stride}, .*")
                for stride in (4, 16)
                for what, figure in (
                    ("build", "histograms"),
                    ("bytes", "bytes of histograms"),
                    ("histogram of 64^2 texels", r"histogram of 64\^2"),
                    ("histogram of 1024^2 texels", r"histogram of 1024\^2"),
                )
            ),
            ("variation of turned boxes from exact", r"mean variation of .*"),
        ],
    ),
    (
        "Light",
        r"light: .*",
        "Tables of spherical harmonics, by glint-shlobes, and the light that a histogram of 24 normals reflects.",
        [
            ("build, lobes", r"SH lobes, .*"),
            ("build, light, 65 x 128 directions", r"SH light, .*, 65x128"),
            ("error, order 60", r"light, error, .*, order 60"),
            ("product integral, order 60", r"light, product integral, .*, order 60"),
            ("Monte Carlo at the same error", r"light, Monte Carlo at equal error, .*, order 60"),
        ],
    ),
    (
        "Displacement",
        r"displacements: .*",
        "Downsampled displacement maps, by glint-displace; the span is over bases.",
        [
            ("build, factor 16, 1024^2", r"displace, factor 16, .*, 1024\^2"),
            ("build, factor 16, 4096^2", r"displace, factor 16, .*, 4096\^2"),
            ("peak memory", r"peak memory, displace .*"),
            ("bytes of T and S", r"bytes of T and S.*"),
            ("reflected light, warm", r"light reflected by .*"),
        ],
    ),
    (
        "Maps, and a plain model",
        r".*",
        "Synthesis, ingest, and a plain microfacet model (GGX) for comparison.",
        [
            ("synthesis", r"synth .*"),
            ("ingest", r"ingest .*"),
            ("GGX, density, warm", r"density, warm, \S+ ggx"),
            ("GGX, half vector drawn, warm", r"sample, warm, \S+ ggx"),
        ],
    ),
]


# Forms of figures that the tables have a place for, and that are not measured.
NOT_MEASURED = {
    *(rf"rel_l2 at {place}, worst octave, \S+ moments" for place in ("centres", "random")),  # moments have no octaves
    r"mean, random, \S+ ggx",  # a plain lobe has no mean over a range
}


def cannot_hold(row):
    """Why the row's target cannot hold for its kind of asset; nothing if it can."""
    return row.get("cannot_hold", "")


def judged(rows):
    """Rows whose targets can hold."""
    return [row for row in rows if row["target"] is not None and not cannot_hold(row)]


def missed(rows):
    return [row for row in judged(rows) if row["value"] > row["target"]]


def limits(rows):
    return "<= " + span([row["target"] for row in rows], rows[0]["unit"])


def verdict(rows):
    """The target of a line and whether its rows meet it."""
    held = judged(rows)
    if not held:
        return "cannot hold" if any(map(cannot_hold, rows)) else ""
    over = len(missed(rows))
    return f"{limits(held)}: {'met' if over == 0 else f'**{over} of {len(held)} missed**'}"


def matching(rows, pattern):
    """Rows whose figures have this form. It is an error if there are none: the figure has another name now, and its line would be lost."""
    found = [row for row in rows if re.fullmatch(pattern, row["figure"])]
    if not found and pattern not in NOT_MEASURED:
        sys.exit(
            f"report.py: error: no figure is named {pattern}; correct the form, measure it again, or add it to NOT_MEASURED"
        )
    return found


def method_table(rows, lines):
    """A line for each summary of figures that were measured."""
    text = ["| figure | measured | target | paper |", "|---|---|---|---|"]
    for label, pattern in lines:
        if found := matching(rows, pattern):
            papers = "; ".join(dict.fromkeys(row["paper"] for row in found if row["paper"])) if len(found) < 8 else ""
            text.append(
                f"| {label} | {span([row['value'] for row in found], found[0]['unit'])} | {verdict(found)} | {papers} |"
            )
    return "\n".join(text)


def folded(title, lines):
    return f"\n<details><summary>{title}</summary>\n\n" + "\n".join(lines) + "\n\n</details>\n" if lines else ""


def target_notes(rows):
    """Targets that cannot hold for the method."""
    text = ""
    for reason in dict.fromkeys(filter(None, map(cannot_hold, rows))):
        group = [row for row in rows if cannot_hold(row) == reason]
        figures = ", ".join(dict.fromkeys(f"*{row['figure'].rpartition(', ')[0]}*" for row in group))
        text += f"\nCannot hold here ({limits(group)}; measured {span([row['value'] for row in group], group[0]['unit'])}): {figures}. {reason}\n"
    return text


def by_method(rows):
    """(title, what it is, its lines, its rows) of each method that was measured."""
    rest = rows
    for title, belongs, what, lines in METHODS:
        own = [row for row in rest if re.fullmatch(belongs, f"{row['section']}: {row['figure']}")]
        rest = [row for row in rest if row not in own]
        if own:
            yield title, what, lines, own


def method_sections(rows, charts):
    """A section for each method that was measured: its chart, and its figures, folded."""
    text = "\n## Every method by itself\n"
    for title, what, lines, own in by_method(rows):
        met = len(judged(own)) - len(missed(own))
        summary = "figures" + (f": {met} of {len(judged(own))} targets are met" if judged(own) else "")
        text += f"\n### {title}\n\n{what}\n{charts.get(title, '')}{folded(summary, [method_table(own, lines), *target_notes(own).splitlines()])}"
    return text


def targets_table(rows):
    """Targets of each method, and the figure that is furthest from its own."""
    text = ["| method | targets met | cannot hold | furthest from its target |", "|---|---|---|---|"]
    for title, _, _, own in by_method(rows):
        if not judged(own):
            continue
        worst = max(judged(own), key=lambda row: row["value"] / row["target"] if row["target"] else 0)
        over = len(missed(own))
        furthest = f"{worst['figure']}: {span([worst['value']], worst['unit'])}, target {limits([worst])}" if over else ""
        text.append(
            f"| [{title}](#{anchor(title)}) | {len(judged(own)) - over} of {len(judged(own))} | {sum(1 for row in own if cannot_hold(row)) or ''} | {furthest} |"
        )
    return "\n".join(text)


def anchor(title):
    """Name of a heading in links."""
    return re.sub(r"[^\w -]", "", title.lower()).replace(" ", "-")


def octave_rows(accuracy):
    """Errors of every octave as rows of the CSV."""
    for name, assets in accuracy.items():
        for asset in assets:
            for level in asset["levels"]:
                for place in ("centres", "random"):
                    for figure, value in level.get(place, {}).items():
                        yield {
                            "section": "octaves",
                            "value": value,
                            "unit": "",
                            "figure": f"{figure} at {place}, {level['sigma_texels']:.0f} texels, {name} {kind_of(asset['asset'], name)}",
                        }


def light_rows(light):
    """Errors of light for every roughness and order as rows of the CSV."""
    for row in light.get("errors_by_order", []):
        figure = f"light, error, {row['light']}, roughness {row['sigma_r']:.2g}, order {row['order']}"
        yield {"section": "light by order", "figure": figure, "value": row["none"], "unit": ""}


def write_csv(rows, path):
    """Every number, a line each."""
    with open(path, "w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(
            file,
            ["section", "figure", "value", "unit", "target", "cannot_hold", "paper", "design", "details"],
            extrasaction="ignore",
            lineterminator="\n",
        )
        writer.writeheader()
        for row in rows:
            details = {name: value for name, value in row.get("details", {}).items() if isinstance(value, (int, float))}
            writer.writerow(
                row
                | {
                    "value": f"{row['value']:.6g}",
                    "details": "; ".join(f"{name} {value:.6g}" for name, value in details.items()),
                }
            )


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
    return {
        (name, kind_of(asset["asset"], name)): (
            asset["size_bytes"] / 1e6,
            mean_error(asset),
            nanoseconds.get((name, kind_of(asset["asset"], name))),
        )
        for name, assets in accuracy.items()
        for asset in assets
    }


def named(rows, pattern, scale=1):
    """Values of the rows whose figures have this form."""
    return [scale * row["value"] for row in matching(rows, pattern)]


def answers_table(rows):
    """Times and errors of an answer, a line for each method."""
    text = [
        "| method | density anywhere | the same again | mean over a range | half vector drawn | error, stored footprints | error, any footprints |",
        "|---|---|---|---|---|---|---|",
    ]
    for title, kind in (
        ("Pyramid", "pyramid"),
        ("Compressed pyramid: CP", r"cp\d+"),
        ("Compressed pyramid: Tucker", "tucker-tolerance"),
        ("Compressed pyramid: PCA", "pca-tolerance"),
        ("Moments", "moments"),
    ):
        cells = [
            times(named(rows, rf"{figure}, \S+ {kind}"))
            for figure in ("density, random", "density, warm", "mean, random", "sample, random")
        ]
        cells += [percents(named(rows, rf"rel_l2 at {place}, worst octave, \S+ {kind}")) for place in ("centres", "random")]
        text.append(line_of(title, cells))
    us = 1e3
    text.append(
        line_of(
            "Bin map",
            [
                times(named(rows, r"bin map, density, .* 2K.*")),
                "",
                "",
                "",
                percents(named(rows, r"bin map, median error, .* 2K.*")),
                "",
            ],
        )
    )
    near = r"flat, round, sigma (?:1|2|4)"
    text.append(
        line_of(
            "Texels",
            [
                times(named(rows, rf"from texels, density, random, .*, {near}", us)),
                "",
                times(named(rows, rf"from texels, mean, .*, {near}", us)),
                "",
                percents(named(rows, rf"from texels, error, density, random, .*, {near}")),
                "",
            ],
        )
    )
    text.append(
        line_of(
            "Histograms",
            [times(named(rows, r"histogram of (?:64|256|1024)\^2, stride 8, .*", us)) + ", all directions", "", "", "", "", ""],
        )
    )
    text.append(
        "| plain GGX, for comparison | "
        + " | ".join(
            times(named(rows, rf"{figure}, \S+ ggx"))
            for figure in ("density, random", "density, warm", "mean, random", "sample, random")
        )
        + " | | |"
    )
    return "\n".join(text)


def line_of(title, cells):
    return f"| [{title}](#{anchor(title)}) | {' | '.join(cells)} |"


def megabytes_of(data, kind):
    """MB of the assets of a kind."""
    return [point[0] for (_, name), point in data.items() if re.fullmatch(kind, name)]


def preparations(rows, data):
    """(title, method, seconds, MB, paper) of each method."""
    ms, mib = 1e-3, 1.048576
    build = {
        "Pyramid": ("pyramid", r"pyramid, flat, .*", 1),
        "Compressed pyramid: CP": ("cp", r"compress, cp .*", 1),
        "Compressed pyramid: Tucker": ("tucker", r"compress, tucker to the error of cp.*", 1),
        "Compressed pyramid: PCA": ("pca", r"compress, pca .*", 1),
        "Bin map": ("bin map", r"bin map, build, .* 2K.*", ms),
        "Moments": ("moments", r"moments, \S+", 1),
        "Histograms": ("histograms", r"histograms, stride 8, .*", 1),
        "Light": ("light", r"SH l.*, 65x128", 1),
        "Displacement": ("displacement", r"displace, factor 16, .*, 1024\^2", 1),
    }
    small = {
        "Bin map": named(rows, r"bin map, bytes, .* 2K.*", mib),
        "Moments": named(rows, r"bytes of moments, .*"),
        "Histograms": named(rows, r"bytes of histograms, stride 8, .*"),
        "Displacement": named(rows, r"bytes of T and S.*", 1e-3),
    }
    kinds = {
        "Pyramid": "pyramid",
        "Compressed pyramid: CP": r"cp\d+",
        "Compressed pyramid: Tucker": "tucker-tolerance",
        "Compressed pyramid: PCA": "pca-tolerance",
    }
    for title, (method, pattern, scale) in build.items():
        paper = "; ".join(dict.fromkeys(row["paper"] for row in matching(rows, pattern) if row["paper"]))
        yield title, method, named(rows, pattern, scale), small.get(title) or megabytes_of(data, kinds.get(title, "")), paper


def preparation_table(rows, data):
    text = ["| method | time | in the paper |", "|---|---|---|"]
    text += [
        line_of(title, [times([1e9 * value for value in seconds]), paper])
        for title, _, seconds, _, paper in preparations(rows, data)
        if seconds
    ]
    return "\n".join(text)


def bytes_table(rows, data):
    papers = {
        "Compressed pyramid: CP": r"bytes, cp .*",
        "Bin map": r"bin map, bytes, .* 2K.*",
        "Histograms": r"bytes of histograms, stride 8, .*",
        "Displacement": r"bytes of T and S.*",
    }
    text = ["| method | asset | in the paper |", "|---|---|---|"]
    for title, _, _, megabytes, _ in preparations(rows, data):
        paper = "; ".join(
            dict.fromkeys(row["paper"] for row in (matching(rows, papers[title]) if title in papers else []) if row["paper"])
        )
        if megabytes:
            text.append(line_of(title, [sizes(megabytes), paper]))
    return "\n".join(text)


def question_sections(data, rows, docs):
    """The questions that people bring, each with a chart and a table."""
    chart(data, 0, "MB", docs / "error-bytes.png")
    chart(data, 2, "nanoseconds of a density query, random", docs / "error-time.png")
    preparation_chart(preparations(rows, data), docs / "prepare-time.png")
    held, excused = judged(rows), sum(1 for row in rows if cannot_hold(row))
    return f"""{scene_section(docs)}{calibration_section(docs)}
## How right, and how quick, is an answer?

{answers_table(rows)}

Errors are of the octave of footprint sizes in which they are largest. Moments are one smooth lobe, whatever the map: their error is that of a lobe. Bin maps of every
roughness, with the median error of their own boxes; texels at footprints of 1 to 4 texels.

![Error against time of a density](error-time.png)

## How small is an asset?

{bytes_table(rows, data)}

CP has as many columns as its paper, Tucker and PCA have its error. `--tolerance` trades bytes for error. Histograms have a stride of 8. The tables of a
displacement need the cells of its map, too.

![Error against bytes](error-bytes.png)

## How long does an asset take to make?

{preparation_table(rows, data)}

Whole processes, from file to file. A compressed pyramid is made from a pyramid, whose time comes before. Light is 65 x 128 directions at order 60: its two tables.
Displacement is of maps of 1024^2 texels.

![Time to make an asset](prepare-time.png)

## What is not reached yet?

{len(held) - len(missed(rows))} of {len(held)} targets are met; {excused} more cannot hold for their kind of asset. Lines of [benchmarks.csv](benchmarks.csv) whose value is above the
target are the missed ones.

{targets_table(rows)}
"""


def method_charts(rows, light, docs):
    """Charts that stand below the tables of methods."""
    charts = {}
    if any(row["figure"].startswith("bytes of histograms") for row in rows):
        name = stride_chart(rows, docs / "histogram-stride.png")
        charts["Histograms"] = (
            f"\nBytes against time, for boxes along the axes anywhere on the map:\n\n![Bytes against time]({name})\n"
        )
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
    machine = machine_text(results["machine"])
    repeats = f"the median of {results['repeats']} runs" if results["repeats"] > 1 else "of one run"
    data = points(accuracy, rows)
    links = ", ".join(f"[{title}](#{anchor(title)})" for title, *_ in by_method(rows))
    calibration = "- [Do plans hold?](#do-plans-hold)\n" if (docs / "plan-calibration.csv").exists() else ""
    text = (
        PAGE.format(methods=links, calibration=calibration)
        + question_sections(data, rows, docs)
        + method_sections(rows, method_charts(rows, light, docs))
    )
    text += CONDITIONS.format(machine=machine, size=results["size_texels"], repeats=repeats)
    (docs / "BENCHMARKS.md").write_text(text, encoding="utf-8")
    write_csv([*rows, *octave_rows(accuracy), *light_rows(light)], docs / "benchmarks.csv")
    print(f"wrote {docs}/BENCHMARKS.md, its charts and benchmarks.csv")


if __name__ == "__main__":
    main()
