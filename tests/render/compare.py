"""Pictures of every method compared with pictures of the Reference: five maps at five distances under a small and a large light.

Normally run by `make limits`, which writes docs/LIMITS.md, docs/limits.csv and docs/limits-*.png. FLIP is measured where the package
flip-evaluator (PyPI) is installed.
"""

import argparse
import json
import pathlib
import sys
import time

import numpy as np

import limits_page
import measures
from contact_sheet import contact_sheet
from gallery import MAPS, MODELS, Gallery, has_blocks, reference_of

sys.path[:0] = [str(pathlib.Path(__file__).parents[2] / folder) for folder in ("pipelines", "pipelines/demo")]
from machine import machine  # noqa: E402
from processes import Tools  # noqa: E402

TEXELS = 1024
SIZE = 48
DISTANCES = (0.25, 0.5, 1, 2, 4)
LIGHTS = (0.5, 10)
FLICKER_DISTANCES = (2,)
MOVE = 0.125  # pixels between two frames
# Footprints at which sizes hand over, and beside them, in deviations of level 0.
HAND_OVERS = (0.7071, 1, 1.4142, 2, 4)
HAND_OVER_SIZE = 24
SIZE_CHANGE = 0.01
# Deviation of level 0 at the default stride: models without levels are asked for the same sizes.
LEVEL_0_TEXELS = 1.5 * 32 / 12**0.5
# Share of the pixels whose footprints are below half of level 0, from which a compressed pyramid need not be drawn: it answers from the
# texels, as the pyramid does.
NEAR_SHARE = 0.95


class Comparison:
    """Draws the pictures of one map and collects rows of figures."""

    def __init__(self, gallery, models, distances, lights):
        self.gallery, self.models, self.distances, self.lights = gallery, models, distances, lights
        self.references = list(dict.fromkeys(reference_of(model) for model in models))
        self.rows = []
        self.pictures = {}  # (model, distance) -> Picture

    def add(self, model, figure, value, **place):
        if value is not None:
            self.rows.append({"map": self.gallery.name, "model": model, "figure": figure, "value": value, **place})

    def draw(self):
        for model in [*self.references, *self.models]:
            for distance in self.distances:
                picture = self.answered_by_texels(model, distance)
                if picture is None:
                    picture = self.gallery.draw(model, distance, self.lights)
                    self.add(
                        model,
                        "microseconds of a mean",
                        1e6 * picture.result["cpu_seconds"] / picture.result["means"],
                        distance=distance,
                    )
                self.pictures[model, distance] = picture

    def answered_by_texels(self, model, distance):
        """The pyramid's picture, where a compressed pyramid has the same."""
        pyramid = self.pictures.get((MODELS[model].source, distance)) if model in MODELS else None
        if pyramid is None:
            return None
        near = pyramid.sigma[pyramid.covered] < 0.5 * LEVEL_0_TEXELS
        return pyramid if near.mean() > NEAR_SHARE else None

    def exposure(self, light):
        """The far picture is grey."""
        return 0.5 / self.pictures[self.references[0], self.distances[-1]].result["mean_radiance"][self.lights.index(light)]

    def pairs(self, model, distance):
        """(light, picture, picture of the reference) for each light."""
        picture, truth = self.pictures[model, distance], self.pictures[reference_of(model), distance]
        return zip(self.lights, picture.radiance, truth.radiance)

    def compare(self):
        for model in self.models:
            for distance in self.distances:
                covered = self.pictures[model, distance].covered
                for light, picture, truth in self.pairs(model, distance):
                    place = {"distance": distance, "light": light}
                    self.add(model, "energy", measures.energy(picture, truth), **place)
                    self.add(model, "rmse", measures.relative_rmse(picture, truth, covered), **place)
                    self.add(model, "flip", measures.flip(picture, truth, self.exposure(light)), **place)

    def flicker(self, distances):
        for distance in distances:
            frames = {model: self.frames(model, distance) for model in [*self.references, *self.models]}
            for model in self.models:
                for light, moved, truth in zip(self.lights, frames[model], frames[reference_of(model)]):
                    self.add(model, "flicker", measures.flicker(moved, truth), distance=distance, light=light)

    def frames(self, model, distance):
        """Three pictures of a steady move for each light."""
        before, after = (self.gallery.draw(model, distance, self.lights, "--shift-x", shift) for shift in (-MOVE, MOVE))
        return list(zip(before.radiance, self.pictures[model, distance].radiance, after.radiance))

    def hand_overs(self):
        """Footprints of one size everywhere, and a little larger."""
        light, distance = self.lights[0], self.distances[len(self.distances) // 2]
        for model in [*self.references, *self.models]:
            for scale in HAND_OVERS:
                sigma = scale * LEVEL_0_TEXELS
                pair = [
                    self.gallery.draw(
                        model,
                        distance,
                        [light],
                        "--shape",
                        "quad",
                        "--sigma",
                        sigma * (1 + step * SIZE_CHANGE),
                        size=HAND_OVER_SIZE,
                    )
                    for step in (-0.5, 0.5)
                ]
                self.add(
                    model,
                    "change with size",
                    measures.change(*(picture.radiance[0] for picture in pair)),
                    sigma=sigma,
                    light=light,
                )

    def borders(self):
        """Steps of the error across borders of blocks over steps beside them, of all distances together, as a screen shows them: else only
        the brightest pixels would count. Pyramids have blocks."""
        for model in filter(has_blocks, self.models):
            steps = {light: [] for light in self.lights}
            for distance in self.distances:
                half = self.pictures[model, distance].half
                for light, picture, truth in self.pairs(model, distance):
                    error = measures.shown(picture, self.exposure(light)) - measures.shown(truth, self.exposure(light))
                    steps[light].append(measures.border_steps(error, half))
            for light, pairs in steps.items():
                across, near = (np.concatenate(parts) for parts in zip(*pairs))
                if measures.rms(near) > 0:
                    self.add(model, "steps at borders", measures.rms(across) / measures.rms(near), light=light)

    def run(self, flicker_distances):
        self.gallery.make(self.models)
        for model in self.models:
            self.add(model, "bytes", self.gallery.bytes[model])
        self.draw()
        self.compare()
        self.flicker(flicker_distances)
        self.hand_overs()
        self.borders()
        return self


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--bin", type=pathlib.Path, default="build/bin", help="folder of the programs")
    parser.add_argument("--out", type=pathlib.Path, default="build/limits", help="folder for assets and results")
    parser.add_argument(
        "--docs", type=pathlib.Path, help="folder for LIMITS.md, limits.csv and the pictures; none are written without it"
    )
    parser.add_argument("--texels", type=int, default=TEXELS, help="of the maps along each axis")
    parser.add_argument("--size", type=int, default=SIZE, help="pixels of the pictures along each axis")
    parser.add_argument("--maps", nargs="+", choices=MAPS, default=list(MAPS), metavar="MAP")
    parser.add_argument("--models", nargs="+", choices=MODELS, default=list(MODELS), metavar="MODEL")
    parser.add_argument("--distances", nargs="+", type=float, default=DISTANCES, metavar="D", help="of the eye, map widths")
    arguments = parser.parse_args()
    if measures.flip_evaluator is None:
        print("flip-evaluator is not installed: FLIP is left out", file=sys.stderr)
    before = machine()  # the load before the run
    start = time.monotonic()
    tools = Tools(arguments.bin)
    rows = []
    for name in arguments.maps:
        gallery = Gallery(tools, arguments.out, name, arguments.texels, arguments.size)
        flicker_distances = [d for d in FLICKER_DISTANCES if d in arguments.distances] or arguments.distances[-1:]
        comparison = Comparison(gallery, arguments.models, arguments.distances, LIGHTS).run(flicker_distances)
        contact_sheet(comparison, (arguments.docs or arguments.out) / f"limits-{name}.png")
        rows += comparison.rows
        results = {
            "machine": before,
            "texels": arguments.texels,
            "size": arguments.size,
            "level_0_texels": LEVEL_0_TEXELS,
            "rows": rows,
        }
        # What was measured stays when a later map is stopped.
        (arguments.out / "results.json").write_text(json.dumps(results, indent=1) + "\n")
        print(f"{name}: {time.monotonic() - start:.0f} s", file=sys.stderr, flush=True)
    if arguments.docs:
        limits_page.write(results, arguments.docs)


if __name__ == "__main__":
    main()
