"""Draws blender.png: brushed metal and flakes in Blender's Cycles by textures of glint-moments, and the same flakes by brute force.

Run it by hand, after make build, with the Python that has bpy (tests/python/integrations/requirements-blender.txt):
python3 docs/pictures/blender.py.
"""

import argparse
import math
import pathlib
import subprocess
import sys
import tempfile

import bpy
import numpy as np

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "pipelines/blender"))
import moments_material as scene

SIZE = 320  # pixels of a picture
HEIGHT = 4
POWER = 1.5  # of the lamp
SAMPLES = 32
LEVEL = 2  # of the textures: 4 texels of the map, about a pixel
TEXELS = 4 * SIZE
PIXEL_FILTER = 0.5  # deviation, pixels
ALPHA = 0.03  # of the flakes themselves
GAP = 8  # pixels between pictures


def blender(folder, textures, power, turn_deg=0):
    """Light of a picture [SIZE][SIZE][3], bottom row first."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene.square_scene(
        scene.moments_material("moments", folder / textures, LEVEL), HEIGHT, 0, power, SIZE, SAMPLES, math.radians(turn_deg)
    )
    scene.render(folder / "picture.exr")
    image = bpy.data.images.load(str(folder / "picture.exr"))
    return np.array(image.pixels[:]).reshape(SIZE, SIZE, -1)[..., :3]


def brute_force(run, folder, power):
    """The same from all texels under each pixel: light from the camera, so that the half vector is the view."""
    place = (np.arange(SIZE) + 0.5) / SIZE * 2 - 1
    x, y = (axis.ravel() for axis in np.meshgrid(place, place))
    distance = np.sqrt(x**2 + y**2 + HEIGHT**2)
    rows = np.stack([x / 2 + 0.5, y / 2 + 0.5, np.full_like(x, PIXEL_FILTER * TEXELS / SIZE), -x / distance, -y / distance], 1)
    np.savetxt(folder / "half.csv", rows, delimiter=",", header="u,v,sigma,hx,hy", comments="")
    run("query", "flakes.glint", "--csv", "half.csv", "--sigma-r", ALPHA / math.sqrt(2), "-o", "density.csv")
    table = np.genfromtxt(folder / "density.csv", delimiter=",", names=True)
    # The microfacet formula: D / (4 cos cos), the lamp's light over the distance squared, and the cosine at the surface.
    light = power * HEIGHT**2 / (4 * math.pi) / distance**2 * table["density"] / (4 * HEIGHT / distance)
    return light.reshape(SIZE, SIZE, 1) * np.array(scene.ALUMINIUM[:3])


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--bin", type=pathlib.Path, default=ROOT / "build/bin")
    tools = parser.parse_args().bin.resolve()
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        run = lambda tool, *words: subprocess.run([tools / f"glint-{tool}", *map(str, words)], cwd=folder, check=True)
        for kind, options in (("brushed", []), ("flake2d", ["--flake-size-uv", 1 / 640, "--roughness", 0.4, "--coverage", 1])):
            short = kind.replace("flake2d", "flakes")
            (folder / short).mkdir()
            run("synth", kind, "--size", TEXELS, *options, "-o", f"{short}.exr")
            run("ingest", f"{short}.exr", "-o", f"{short}.glint")
            run(
                "moments",
                f"{short}.glint",
                "-o",
                f"{short}.moments.glint",
                "--roughness",
                math.sqrt(ALPHA),
                "--lobe",
                "materialx",
                "--bits",
                16,
                "--textures",
                short,
            )
        pictures = [
            blender(folder, "brushed", POWER, turn_deg=30),
            blender(folder, "flakes", POWER),
            brute_force(run, folder, POWER),
        ]
        print("mean light of flakes, Cycles and brute force:", *(float(picture.mean()) for picture in pictures[1:]))
    gap = np.ones((SIZE, GAP, 3))
    row = np.concatenate([pictures[0], gap, pictures[1], gap, pictures[2]], 1)
    image = bpy.data.images.new("row", row.shape[1], SIZE, float_buffer=True)
    image.pixels = np.concatenate([row, np.ones_like(row[..., :1])], 2).ravel().tolist()
    settings = bpy.context.scene.render.image_settings
    settings.file_format, settings.color_mode, settings.color_depth, settings.compression = "PNG", "BW", "8", 100
    image.save_render(str(ROOT / "docs/pictures/blender.png"), scene=bpy.context.scene)


if __name__ == "__main__":
    main()
