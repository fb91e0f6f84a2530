"""UDIM sets from Python: one model for all tiles, whose uv counts tiles."""

import shutil

import numpy as np
import pytest

import glint_ndf as gn

PRINTED = 1e-6  # glint-query prints nine digits


@pytest.fixture(scope="module")
def folder(run_tool, tmp_path_factory):
    """A set of three tiles: maps and pyramids."""
    folder = tmp_path_factory.mktemp("udim")
    for tile, seed in ((1001, 1), (1002, 2), (1011, 3)):
        run_tool("glint-synth", "isotropic", "--size", 96, "--seed", seed, "-o", folder / f"n.{tile}.exr")
    run_tool("glint-ingest", folder / "n.<UDIM>.exr", "-o", folder / "n.<UDIM>.map.glint")
    run_tool(
        "glint-pyramid",
        folder / "n.<UDIM>.map.glint",
        "-o",
        folder / "n.<UDIM>.p.glint",
        "--stride",
        8,
        "--sigma-r",
        0.05,
        "--resolution",
        64,
    )
    return folder


UV = np.array([[0.3, 0.4], [1.02, 0.6], [0.7, 0.99], [0.4, 1.7], [1.5, 1.5]])  # the last one is in no tile


@pytest.mark.parametrize("precision", [np.float64, np.float32])
def test_a_set_answers_as_glint_query(run_tool, folder, precision):
    ndf = gn.open(folder / "n.<UDIM>.p.glint")
    assert (ndf.udim_tiles, ndf.kind, ndf.width, ndf.boundary, ndf.endless) == (3, "ndf-pyramid", 96, "clamp", True)
    density = ndf.density(UV.astype(precision), [0.1, -0.05], sigma=8)
    asked = [
        float(run_tool("glint-query", folder / "n.<UDIM>.p.glint", "--uv", *uv, "--sigma", 8, "--half", 0.1, -0.05))
        for uv in UV
    ]
    rounding = 1e-3 if precision == np.float32 else PRINTED  # a float of uv is a part of a texel off
    assert np.allclose(density, asked, rtol=rounding)
    assert density[4] == 0 < density[:4].min()
    _, pdf = ndf.sample(UV.astype(precision), [0.3, 0.6], sigma=8)
    assert pdf[4] == 0 < pdf[:4].min()


def test_normals_of_a_set_answer_small_footprints(folder):
    ndf = gn.open(folder / "n.<UDIM>.p.glint", normals=folder / "n.<UDIM>.map.glint")
    assert ndf.has_normals
    texels = gn.open(folder / "n.<UDIM>.map.glint", sigma_r=0.05)
    h = [0.05, 0]
    assert np.allclose(ndf.density(UV, h, sigma=1), texels.density(UV, h, sigma=1), rtol=1e-2, atol=1e-3)


def test_brdfs_count_tiles(folder):
    ndf = gn.open(folder / "n.<UDIM>.p.glint")
    wi, wo = np.array([0.1, 0, np.sqrt(1 - 0.01)]), np.array([0, 0, 1.0])
    f, _ = ndf.brdf().evaluate(UV, wi, wo, sigma=8)
    assert (f[:4] > 0).all() and (f[4] == 0).all()
    assert not np.allclose(f[0], f[1])


def test_wrong_uses_say_what_to_do(folder):
    with pytest.raises(gn.FileError, match="no file of a tile"):
        gn.open(folder / "none.<UDIM>.glint")
    with pytest.raises(gn.ArgumentError, match="pattern"):
        gn.open(folder / "n.<UDIM>.p.glint", normals=folder / "n.1001.map.glint")
    with pytest.raises(gn.UnsupportedError, match="glint-pyramid"):
        gn.pyramid(gn.load(folder / "n.1001.map.glint"))
