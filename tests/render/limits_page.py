"""Writes docs/LIMITS.md and docs/limits.csv from the figures of compare.py."""

import csv
import json
import pathlib
import sys
import textwrap
from math import radians, tan

sys.path.insert(0, str(pathlib.Path(__file__).parents[1] / "stability"))
sys.path.insert(0, str(pathlib.Path(__file__).parents[2] / "pipelines"))
from limits_section import with_section
from machine import machine_text
from gallery import MODELS, REFERENCES, reference_of

# Largest values that a good method has. Steps: 1 is the noise beside a side of a block, which the sides of five pictures tell to a tenth.
TARGETS = {"energy": 0.02, "flicker": 1.1, "change with size": 0.03, "steps at borders": 1.2}
PERCENT = {"energy", "rmse", "change with size"}
PLACES = ("distance", "light", "sigma")

PAGE = """# Limits

Written by `make limits`; do not edit. Every number is in [limits.csv](limits.csv).

Errors of distributions say little about pictures. So a small renderer ([tests/render](../tests/render)), which includes public headers only, draws a ball
on a square with every method, and its pictures are compared with brute force over the texels (the Reference).

{machine}
Pictures of {size}x{size} pixels of {map_count} maps of {texels}x{texels} texels (glint-synth, arguments: `tests/render/gallery.py`), the map as wide as one unit
of the scene.

## What the pictures show

- **Light** is one far disk, {small:g} degrees wide (the sun, a spot) or {large:g} degrees wide (a lamp). Facets are mirrors, and there are no shadows.
- **Distance** of the eye is in map widths. The scene grows with the distance, so every picture has the same ball and square, and only the texels of a
  pixel become more: a footprint in the middle of the square has a deviation of {sigmas} texels. The square is seen at 45 degrees, so footprints are stretched.
- **Footprints** come from ray differentials, one for each pixel. Bin maps and histograms know boxes: they are asked for the boxes of the same second
  moments, and are compared with brute force over such boxes.
- **The light's half vectors** fill an ellipse, cut into strips of .025. Each strip is one question for a mean over a range. So there is no noise of
  sampling, and the light is the same for every method.
- Compressed pyramids: tucker and pca with `--tolerance 0.1`, cp with `--rank 16`. Pyramids, compressed or not, have the normals too, from which they answer
  footprints smaller than level 0 ({level_0:.1f} texels). Where nearly all footprints are, a compressed pyramid has the picture of the pyramid. All else is
  the default of the tools.

## How to read the numbers

| figure | what it is | target |
|---|---|---|
| energy | light of the picture over that of the Reference's, minus 1 | within 2 % |
| RMSE | RMS of the difference over RMS of the Reference's picture, where there is a surface | |
| FLIP | difference that a person sees in turns of the two pictures, 0 to 1 (flip-evaluator, 67 pixels for a degree) | |
| flicker | RMS of the second difference of three frames, each moved by 1/8 pixel, over that of the Reference's frames | <= 1.1 |
| change with size | RMS change of a picture for a footprint larger by 1 %, at sizes from .7 to 4 times level 0's | <= 3 %, or 1.1 times the Reference's |
| steps at borders | RMS steps of the error, as a screen shows it, across a side of a 16-pixel block, over those beside it; steps that agree along a side count more, as lines do | <= 1.2 |

The time is that of one mean over a range on one core; a picture asks one for each strip of the light and pixel. The Reference visits the texels of a
footprint once for all strips.

{overview}

{reference_change}

## Where each method fails

{failures}

## Map by map

RMSE under the small light / under the large light, at each distance. Pictures: a row for each method, the small light at the left; greys are the same in
each half.

{maps}
"""

# Reasons of what is seen; the numbers are in the lists below them.
NEAR = "Near pictures come from the texels: they are right, and slow."
SEEN = {
    "pyramid": "The lobe of a facet is narrower than a pixel of the images (.64 pixels at the default --resolution), and the small light is as wide as one pixel. "
    "So where a footprint holds few facets or thin lines of directions, far scratches and brushed metal above all, pictures under the small light are "
    f"softer and lose a few percent of the light: glint-pyramid --resolution auto makes the pixels smaller than the lobe. {NEAR}",
    "tucker": "It errs as the pyramid does, and by its tolerance, which holds for each half vector on average over places and not for each place.",
    "cp": "It errs as the pyramid does, and by its rank. Negative parts of low rank are cut, which leaves light where there should be none.",
    "pca": "It errs as tucker does.",
    "bin map": "Its pictures are those of brute force over boxes. Boxes have hard edges, so sparkles appear and vanish at once as the picture moves, more than under "
    "Gaussians.",
    "histograms": "Directions are known to ten degrees: sparkles are spread over a bin, and edges of bins show on smooth surfaces under small lights. Take them for "
    "environments, not for lamps.",
    "moments": "One smooth lobe for each pixel: no sparkle, whatever the light. It is right where slopes are about normally distributed and a pixel holds so many "
    "facets that nothing sparkles, as the noise seen from afar. Elsewhere the lobe lights directions that have no facets, and lobes of grooves and threads run "
    "together.",
}


def shown_value(figure, value):
    return f"{100 * value:.1f} %" if figure in PERCENT else f"{value:.2g}" if value < 10 else f"{value:.0f}"


def span(figure, values):
    """The least and the greatest value."""
    if not values:
        return ""
    low, high = shown_value(figure, min(values)).removesuffix(" %"), shown_value(figure, max(values))
    return high if low == high.removesuffix(" %") else f"{low} to {high}"


def select(rows, **wanted):
    return [row for row in rows if all(row.get(name) == value for name, value in wanted.items())]


def values(rows, **wanted):
    return [row["value"] for row in select(rows, **wanted)]


def is_over(row, rows):
    """Whether a row is over its target. A picture may change with size as much as the Reference's does."""
    target = TARGETS.get(row["figure"])
    if target is None or row["model"] not in MODELS:
        return False
    if row["figure"] == "change with size":
        same = {name: row[name] for name in ("map", "figure", *PLACES) if name in row}
        target = max([target, *(1.1 * value for value in values(rows, model=reference_of(row["model"]), **same))])
    return abs(row["value"]) > target


def misses(rows, **wanted):
    """Rows over their target."""
    return [row for row in select(rows, **wanted) if is_over(row, rows)]


def overview_table(rows, models, lights):
    columns = [
        ("energy, small light", "energy", {"light": lights[0]}),
        ("energy, large light", "energy", {"light": lights[-1]}),
        ("RMSE", "rmse", {}),
        ("FLIP", "flip", {}),
        ("flicker", "flicker", {}),
        ("change with size", "change with size", {}),
        ("steps at borders", "steps at borders", {}),
        ("time of a mean, µs", "microseconds of a mean", {}),
    ]
    columns = [column for column in columns if values(rows, figure=column[1])]
    lines = ["| method | " + " | ".join(title for title, *_ in columns) + " |", "|---" * (len(columns) + 1) + "|"]
    for model in models:
        cells = []
        for _, figure, more in columns:
            text = span(figure, values(rows, model=model, figure=figure, **more))
            cells.append(f"**{text}**" if misses(rows, model=model, figure=figure, **more) else text)
        lines.append(f"| {model} | " + " | ".join(cells) + " |")
    return "\n".join(lines) + "\n\nSpans are over all maps, distances and lights. Bold: over the target."


def map_section(rows, name, models, distances, lights):
    lines = [
        f"### {name}",
        "",
        f"![Pictures of {name} by every method](limits-{name}.png)",
        "",
        "| method | bytes | " + " | ".join(f"distance {distance:g}" for distance in distances) + " |",
        "|---" * (len(distances) + 2) + "|",
    ]
    for model in models:
        errors = [
            " / ".join(
                shown_value("rmse", value)
                for light in lights
                for value in values(rows, map=name, model=model, figure="rmse", distance=distance, light=light)
            )
            for distance in distances
        ]
        size = values(rows, map=name, model=model, figure="bytes")
        lines.append(f"| {model} | {size[0] / 1e6:.1f} MB | " + " | ".join(errors) + " |")
    return "\n".join(lines)


def place_of(row):
    return ", ".join([row["map"], *(f"{place} {row[place]:.3g}" for place in PLACES if place in row)])


def failure_section(rows, model):
    """What is seen, and a folded list of the missed targets."""
    over = misses(rows, model=model)
    judged = [row for row in select(rows, model=model) if row["figure"] in TARGETS]
    text = f"### {model}\n\n{textwrap.fill(SEEN[model], 150)}\n\n"
    if not over:
        return text + f"All {len(judged)} targets are met."
    lines = [f"- {row['figure']}: {shown_value(row['figure'], row['value'])} ({place_of(row)})" for row in over]
    return (
        text
        + f"<details><summary>{len(over)} of {len(judged)} targets missed</summary>\n\n"
        + "\n".join(lines)
        + "\n\n</details>"
    )


def reference_change(rows):
    spans = [
        f"{name}: {span('change with size', found)}"
        for name in REFERENCES
        if (found := values(rows, model=name, figure="change with size"))
    ]
    return (
        "Pictures by brute force change by so much for footprints larger by 1 %: "
        + "; ".join(spans)
        + ". Footprints with hard edges change more."
    )


def footprints_in_the_middle(texels, size, distances):
    """Deviations of the footprints in the middle of the square: the field of view is 35 degrees wide, and a pixel's filter half a pixel."""
    return ", ".join(f"{0.5 * texels * distance * 2 * tan(radians(17.5)) / size * 2 ** 0.25:.0f}" for distance in distances)


def write(results, docs):
    """Writes the page and the CSV."""
    rows = results["rows"]
    ordered = lambda key: list(dict.fromkeys(row[key] for row in rows if key in row))
    distances, lights, names = sorted(ordered("distance")), sorted(ordered("light")), ordered("map")
    models = [model for model in ordered("model") if model in MODELS]
    text = PAGE.format(
        machine=machine_text(results["machine"]),
        size=results["size"],
        texels=results["texels"],
        map_count=len(names),
        small=lights[0],
        large=lights[-1],
        sigmas=footprints_in_the_middle(results["texels"], results["size"], distances),
        level_0=results["level_0_texels"],
        overview=overview_table(rows, models, lights),
        reference_change=reference_change(rows),
        failures="\n\n".join(failure_section(rows, model) for model in models),
        maps="\n\n".join(map_section(rows, name, models, distances, lights) for name in names),
    )
    stability = docs / "stability.json"
    if stability.exists():
        text = with_section(text, json.loads(stability.read_text()))
    (docs / "LIMITS.md").write_text(text, encoding="utf-8")
    with open(docs / "limits.csv", "w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, ["map", "model", "figure", "value", *PLACES], lineterminator="\n")
        writer.writeheader()
        for row in rows:
            writer.writerow(row | {"value": f"{row['value']:.6g}"})
