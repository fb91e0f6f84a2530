"""Textures of glint-moments in Blender's Cycles: the lobe that Cycles draws is the lobe of the map.

The lamp is at the camera, so that the half vector of a pixel is known: its slopes are the pixel's place over the height. The slopes of
a GGX lobe have contours x^T M x with M = (alpha^2)^-1, and the light along them falls as (1 + x^T M x)^-2. So M is fitted to the picture.
"""

import os
import subprocess
import sys

import h5py
import numpy as np
import pytest
from conftest import PIPELINES, run

PYTHON = os.environ.get("GLINT_BLENDER_PYTHON", sys.executable)  # bpy needs an older numpy than others
HAS_BLENDER = subprocess.run([PYTHON, "-c", "import bpy"], capture_output=True).returncode == 0
pytestmark = pytest.mark.skipif(
    not HAS_BLENDER, reason="no module bpy; see requirements-blender.txt, and set GLINT_BLENDER_PYTHON"
)

SCRIPT = PIPELINES / "blender" / "moments_material.py"
HEIGHT = 4  # of the camera; the corners of the square have slopes of 0.35
POWER = 6  # of the lamp; at the middle as if it were at a height of 1
REFLECTANCE = 0.914  # of green, of the script's aluminium
RESOLUTION = 96
ALPHA_ERROR = 0.02  # pixels are filtered, and Fresnel and masking are left out of the fit
LIGHT_ERROR = 0.02  # twice the error of the fit
ANGLE_ERROR_DEG = 0.2  # of the fit
TURN_DEG = 30
LEAST_ASPECT = 0.1  # of both alphas, in Blender


# Blender reads its own pictures: bottom row first.
READ = """
import bpy, numpy, sys
image = bpy.data.images.load(sys.argv[1])
numpy.save(sys.argv[2], numpy.array(image.pixels[:]).reshape(image.size[1], image.size[0], -1))
"""


def make(folder, map_file, roughness, kind="normal"):
    """Textures of a map. Returns the matrix alpha^2 of the whole map, and the last level, which has one texel."""
    (folder / "t").mkdir()
    run(
        folder,
        f"ingest {map_file} --kind {kind} -o n.glint",
        f"moments n.glint -o m.glint --finest 0 --roughness {roughness} --lobe materialx --bits 16 --textures t",
    )
    with h5py.File(folder / "m.glint") as file:
        level = int(file.attrs["level_count"]) - 1
        xx, xy, yy = file[f"level_{level:02}/moments"][0, 0, 2:]
    return 2 * np.array([[xx, xy], [xy, yy]], np.float64), level


def draw(folder, level, turn_deg=0):
    """Light of a picture, linear; bottom row first."""
    arguments = [
        "t",
        "-o",
        "picture.exr",
        "--level",
        level,
        "--turn-deg",
        turn_deg,
        "--height",
        HEIGHT,
        "--lamp-radius",
        0,
        "--power",
        POWER,
        "--resolution",
        RESOLUTION,
        "--samples",
        16,
    ]
    subprocess.run([PYTHON, SCRIPT, *map(str, arguments)], cwd=folder, check=True, capture_output=True, timeout=300)
    subprocess.run(
        [PYTHON, "-c", READ, folder / "picture.exr", folder / "picture.npy"], check=True, capture_output=True, timeout=60
    )
    return np.load(folder / "picture.npy")[..., 1]


def fitted(light):
    """The larger and the smaller alpha of the picture, and the angle of the larger in degrees."""
    place = ((np.arange(RESOLUTION) + 0.5) / RESOLUTION * 2 - 1) / HEIGHT
    x, y = np.meshgrid(place, place)
    # What is left of the light without the cosines of the lamp's distance, of the view and of the projected normal.
    cosine = 1 / np.sqrt(1 + x**2 + y**2)
    root = 1 / np.sqrt(light * cosine**3)
    used = root < 3 * root.min()
    terms = np.stack([np.ones_like(x), x**2, 2 * x * y, y**2], -1)[used]
    weights = 1 / root[used]
    (peak, xx, xy, yy), *_ = np.linalg.lstsq(terms * weights[:, None], root[used] * weights, rcond=None)
    return lobe(np.linalg.inv(np.array([[xx, xy], [xy, yy]]) / peak))


def lobe(squared):
    values, vectors = np.linalg.eigh(squared)
    return np.sqrt(values[1]), np.sqrt(values[0]), np.degrees(np.arctan2(vectors[1, 1], vectors[0, 1])) % 180


def turns_apart(a_deg, b_deg):
    return abs((a_deg - b_deg + 90) % 180 - 90)


def test_roughness_is_the_alpha_of_the_map(tmp_path):
    run(tmp_path, "synth isotropic --size 128 --alpha .25 -o map.exr")
    squared, level = make(tmp_path, "map.exr", 0.3)
    assert np.sqrt(np.trace(squared) / 2) == pytest.approx(np.hypot(0.25, 0.3**2), rel=0.01)
    light = draw(tmp_path, level)
    expected = lobe(squared)
    assert fitted(light)[:2] == pytest.approx(expected[:2], rel=ALPHA_ERROR)
    # The lamp's light of POWER, by the microfacet formula at the middle: D / 4, and D = 1 / (pi alpha alpha).
    middle = light[RESOLUTION // 2 - 1 : RESOLUTION // 2 + 1, RESOLUTION // 2 - 1 : RESOLUTION // 2 + 1].mean()
    assert middle == pytest.approx(POWER / (4 * np.pi) * REFLECTANCE / 4 / (np.pi * expected[0] * expected[1]), rel=LIGHT_ERROR)


def test_highlights_of_brushed_metal_lie_across_the_brushing(tmp_path):
    run(tmp_path, "synth brushed --size 128 -o map.exr")
    squared, level = make(tmp_path, "map.exr", 0.25)
    large, small, angle = fitted(draw(tmp_path, level))
    assert turns_apart(angle, 90) < ANGLE_ERROR_DEG  # streaks run along u
    assert (large, small) == pytest.approx(lobe(squared)[:2], rel=ALPHA_ERROR)
    *_, turned = fitted(draw(tmp_path, level, TURN_DEG))
    assert turns_apart(turned, 90 + TURN_DEG) < ANGLE_ERROR_DEG


def test_rotation_turns_counter_clockwise(tmp_path):
    """Waves that run along (2, 1): their slopes, and the larger alpha, are at 26.6 degrees from u."""
    size, rng = 128, np.random.default_rng(1)
    y, x = np.mgrid[:size, :size]
    heights = sum(np.cos(2 * np.pi * (m * (2 * x + y) / size + rng.random())) / m for m in range(1, 9))
    with open(tmp_path / "map.pfm", "wb") as file:  # bottom row first, little-endian
        file.write(f"Pf\n{size} {size}\n-1.0\n".encode() + (0.6 * heights).astype("<f4").tobytes())
    squared, level = make(tmp_path, "map.pfm", 0.3, "height")
    expected = lobe(squared)
    assert turns_apart(expected[2], np.degrees(np.arctan2(1, 2))) < 1  # central differences are less steep for short waves
    found = fitted(draw(tmp_path, level))
    assert turns_apart(found[2], expected[2]) < ANGLE_ERROR_DEG
    assert found[:2] == pytest.approx(expected[:2], rel=ALPHA_ERROR)


def test_blender_stretches_lobes_to_ten_to_one_at_most(tmp_path):
    run(tmp_path, "synth brushed --size 128 --alpha .5 -o map.exr")
    squared, level = make(tmp_path, "map.exr", 0.16)
    expected = lobe(squared)
    assert expected[1] / expected[0] < LEAST_ASPECT
    large, small, _ = fitted(draw(tmp_path, level))
    assert small / large == pytest.approx(LEAST_ASPECT, rel=2 * ALPHA_ERROR)
    assert large * small == pytest.approx(expected[0] * expected[1], rel=2 * ALPHA_ERROR)


@pytest.mark.parametrize(
    "name, message", [("a.png", "normal_00.png: no such texture"), ("a.jpeg", "a.jpeg is neither .png nor .exr")]
)
def test_wrong_use_is_refused_and_leaves_nothing(tmp_path, name, message):
    process = subprocess.run([PYTHON, SCRIPT, tmp_path, "-o", tmp_path / name], capture_output=True, text=True)
    assert process.returncode != 0 and message in process.stderr
    assert list(tmp_path.iterdir()) == []
