"""The scenes of the gallery build, render, glint, and do not flicker."""

import os
import pathlib
import sys

import numpy as np
import pytest

SCENES = pathlib.Path(__file__).resolve().parents[2] / "pipelines" / "scenes"
sys.path.insert(0, str(SCENES))

pytest.importorskip("mitsuba")
pytest.importorskip("PIL")

import kit as kits  # noqa: E402
import shapes  # noqa: E402

BIN = pathlib.Path(os.environ.get("GLINT_BIN_DIR", "build/bin")).resolve()
SIZE = (32, 32)

# How much more neighbouring pixels differ where there are glints than on smooth metal of the same mean roughness. With so few pixels and samples, noise of
# sampling is the floor of both; maps of the gallery reach 1.7 and more.
GLINTS_AT_LEAST = 1.4
# Flicker of a zoom over that of the exact answer (1: none is added). Between its levels a pyramid errs by a few per cent; one texel for each sample gives more than 3.
FLICKER_AT_MOST = 1.3
NAIVE_FLICKER_AT_LEAST = 2.0


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("gallery")


@pytest.fixture(scope="module")
def mitsuba():
    kits.start_mitsuba()
    import mitsuba

    return mitsuba


@pytest.fixture
def render(mitsuba, folder):
    def render(module, smooth=False, seed=0, **how):
        kit = kits.Kit(BIN, folder, quick=True, smooth=smooth)
        scene = mitsuba.load_dict(module.scene(kit, **how))
        return np.array(mitsuba.render(scene, seed=seed))

    return render


def roughness(image):
    """Median of the ratios of neighbouring pixels, as differences of logarithms: edges of a highlight do not count, glints all over do."""
    grey = np.log(image.mean(axis=2) + 1e-3)
    return float(np.mean([np.median(np.abs(np.diff(grey, axis=k))) for k in (0, 1)]))


@pytest.mark.parametrize(
    "name", ["bent_quad", "kettle", "car_paint", "cutlery", "ball", "cloth", "diffraction", "plane", "environment"]
)
def test_scenes_render_light(render, name):
    image = render(__import__(name), size=SIZE, spp=2)
    assert image.shape == (*SIZE[::-1], 3)
    assert np.isfinite(image).all()
    assert (image >= 0).all()
    assert image.mean() > 0.005


@pytest.mark.parametrize("name", ["flakes", "scratches"])
def test_the_sheet_glints(render, name):
    import bent_quad

    how = dict(name=name, size=SIZE, spp=256, fov=8.0)  # with fewer samples their noise hides glints
    glints, smooth = (render(bent_quad, smooth=smooth, **how) for smooth in (False, True))
    assert roughness(glints) > GLINTS_AT_LEAST * roughness(smooth)


def test_a_zoom_does_not_flicker(render):
    import animation
    import ball

    # From 16 texels a pixel: footprints are just above the finest level of the pyramid, and the exact answer is quick.
    widths = 32 * 16 * 1e-4 * ball.TEXEL_UM * 1.1 ** np.arange(4)
    flicker = {}
    for title, how in {
        "exact": {"asset": lambda of: of.normals},
        "pyramid": {},
        "naive": {"bsdf": animation.one_texel},
    }.items():
        frames = [render(ball, width_cm=width, size=SIZE, spp=4, max_depth=2, **how) for width in widths]
        flicker[title] = animation.flicker(frames, 1.1)
    print(flicker)
    assert flicker["pyramid"] < FLICKER_AT_MOST * flicker["exact"], flicker
    assert flicker["naive"] > NAIVE_FLICKER_AT_LEAST * flicker["exact"], flicker


def test_flicker_of_a_still_picture_of_one_value_is_zero():
    import animation

    assert animation.flicker([np.full((32, 32, 3), 0.5)] * 3, 1.1) == pytest.approx(0, abs=1e-9)


def test_flicker_sees_a_frame_that_pops():
    import animation

    frames = [np.full((32, 32, 3), value) for value in (0.5, 0.5, 0.6, 0.5)]
    assert animation.flicker(frames, 1.1) == pytest.approx(0.2 / 3 / 0.525, rel=1e-6)


def test_the_tone_curve_rises_and_keeps_grey_grey():
    grey = np.linspace(0, 50, 2000)
    shown = kits.tone(np.repeat(grey[:, None], 3, axis=1))
    assert (np.diff(shown[:, 0]) > 0).all()
    assert shown.max() < 1
    assert np.ptp(shown, axis=1).max() < 1e-9


def test_a_turned_circle_is_a_sphere_with_normals_outwards(folder):
    angle = np.linspace(-np.pi / 2, np.pi / 2, 200)
    mesh = shapes.lathe(np.stack([np.maximum(3 * np.cos(angle), 0), 3 * np.sin(angle)], 1), 1.0, columns=100)
    points, normals = np.vstack(mesh.points), np.vstack(mesh.normals)
    away = np.linalg.norm(points, axis=1) * np.sign(np.sum(points * normals, axis=1))
    assert np.allclose(away, 3)
    assert np.sum(points / 3 * normals, axis=1).min() > 0.999


def test_every_body_faces_outwards():
    import cutlery
    import kettle

    for mesh in (cutlery.spoon(), cutlery.knife(), kettle.spout(), kettle.handle()):
        points, faces = np.vstack(mesh.points), np.vstack(mesh.faces)
        a, b, c = (points[faces[:, k]] for k in range(3))
        # The volume of a closed body is positive when its triangles face outwards; open ends change little.
        assert np.sum(a * np.cross(b, c)) / 6 > 0


def test_a_glint_stays_and_a_rare_flash_is_cut():
    import gallery

    passes = np.full((8, 4, 4, 3), 0.5)
    passes[:, 1, 1] = 40.0  # a glint is in every pass
    passes[3, 2, 2] = 40.0  # a flash is in one
    image = gallery.combined(passes)
    assert image[1, 1] == pytest.approx(40)
    assert image[2, 2].max() < 2 * 0.5
    assert image[0, 0] == pytest.approx(0.5)


def test_the_index_says_how_each_picture_was_made():
    import gallery

    entry = {
        "name": "kettle",
        "file": "kettle.png",
        "title": "A kettle",
        "alt": "A kettle on a table",
        "text": "It is of steel.",
        "method": "pyramid",
        "spp": 48,
        "seconds": 12.3,
        "table": ["| a |", "|---|"],
    }
    text = gallery.index_text([entry], "pictures/")
    for part in (
        "## A kettle",
        "![A kettle on a table](pictures/kettle.png)",
        "It is of steel.",
        "| a |\n|---|",
        "*pyramid; 48 samples a pixel; 12 s of processor time.*",
    ):
        assert part in text
