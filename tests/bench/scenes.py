"""Which method for which scene: the section of the page of measurements that reads what pictures show, from docs/limits.csv."""

import csv

import matplotlib.pyplot as plt
from charts import COLOURS, MARKERS, finish, legend
from words import times

SURFACES = {
    "isotropic": "fine noise",
    "brushed": "brushed metal",
    "scratches": "scratches",
    "weave": "a weave",
    "flakes": "flakes",
}
SMALL_LIGHT = "0.5"
DISTANCES = {"0.25": "2", "1": "8", "4": "32"}  # of the eye in map widths: deviations in the middle of the square, texels
COMPRESSED = ("cp", "tucker", "pca")
CLOSE, ROUGH = 0.02, 0.1  # FLIP of the methods in the table; 0 is equal pictures


class Pictures:
    """Figures of docs/limits.csv."""

    def __init__(self, path):
        self.values = {}
        with open(path, newline="", encoding="utf-8") as file:
            for row in csv.DictReader(file):
                self.values[row["map"], row["model"], row["figure"], row["distance"], row["light"]] = float(row["value"])

    def models(self):
        return list(dict.fromkeys(model for _, model, *_ in self.values if not model.startswith("Reference")))

    def flip(self, surface, model, distance, light=SMALL_LIGHT):
        return self.values.get((surface, model, "flip", distance, light))

    def microseconds(self, surface, model, distance):
        """Of a mean over a range; nothing if it was not timed. Where a compressed pyramid answers as the pyramid does, that was timed."""
        timed = (model, "pyramid") if model in COMPRESSED else (model,)
        times = [self.values.get((surface, name, "microseconds of a mean", distance, "")) for name in timed]
        return next((time for time in times if time is not None), None)


def quickest(pictures, surface, distance, flip):
    """(microseconds, the quickest method whose picture has at most this FLIP, its FLIP); nothing if there is none."""
    figures = [
        (pictures.microseconds(surface, model, distance), pictures.flip(surface, model, distance), model)
        for model in pictures.models()
    ]
    able = [
        (time, model) for time, of_model, model in figures if time is not None and of_model is not None and of_model <= flip
    ]
    return (*min(able), pictures.flip(surface, min(able)[1], distance)) if able else None


def scene_cell(pictures, surface, distance):
    """The quickest close method, and a rough one that takes at most half its time."""
    close, rough = (quickest(pictures, surface, distance, flip) for flip in (CLOSE, ROUGH))
    words = [
        f"{title}**{found[1]}**, {times([1e3 * found[0]])} ({found[2]:.2g})"
        for title, found in (("", close), ("rough: ", rough if close is None or rough[0] <= 0.5 * close[0] else None))
        if found
    ]
    return "; ".join(words) or "none"


def scene_table(pictures):
    """The quickest method whose picture is close, or roughly right, for each surface and distance."""
    text = [
        f"| surface | {' | '.join(f'pixels of {texels} texels' for texels in DISTANCES.values())} |",
        "|---" * (1 + len(DISTANCES)) + "|",
    ]
    for surface, words in SURFACES.items():
        text.append(f"| {words} | {' | '.join(scene_cell(pictures, surface, distance) for distance in DISTANCES)} |")
    return "\n".join(text)


def scene_chart(pictures, path):
    """FLIP against the time of a mean, far away."""
    figure, axis = plt.subplots(figsize=(6, 4))
    far = list(DISTANCES)[-1]
    for k, surface in enumerate(SURFACES):
        for model in pictures.models():
            point = pictures.microseconds(surface, model, far), pictures.flip(surface, model, far)
            if None not in point:
                axis.plot(*point, MARKERS[k], color=COLOURS[model], markersize=7)
    for flip in (CLOSE, ROUGH):
        axis.axhline(flip, color="0.5", linestyle=":")
    legend(axis, pictures.models(), SURFACES.values())
    finish(figure, axis, path, xlabel="microseconds of a mean over a range", ylabel=f"FLIP, pixels of {DISTANCES[far]} texels")


def scene_section(docs):
    """Which method for which scene; nothing where no pictures were made."""
    if not (docs / "limits.csv").exists():
        return ""
    pictures = Pictures(docs / "limits.csv")
    scene_chart(pictures, docs / "flip-time.png")
    return f"""
## Which method for my scene?

The quickest method whose pictures are close to those of brute force (FLIP up to {CLOSE}; *rough*: up to {ROUGH}), by the surface and by how much of it a pixel sees. The
light is as small as the sun, and glints are hardest under small lights. Time is of one mean over a range of half vectors; the number in brackets is the FLIP of the picture:
what a person sees who looks at both in turns, 0 to 1.

{scene_table(pictures)}

From far away, each point is a method (colour) on a surface (marker). Down and to the left is better.

![FLIP against the time of a mean](flip-time.png)

Bin maps answer boxes, and are compared with brute force over boxes. Tucker and PCA have `--tolerance 0.1`, CP `--rank 16`: a smaller tolerance errs less. Your
tolerance is another one: `glint-plan` [chooses](TOOLS.md#plans) for a scene. What each method does to pictures is in [LIMITS](LIMITS.md).
"""
