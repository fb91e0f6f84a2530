"""Maps of glint-synth flake2d against the code of MaterialX's node itself."""

import h5py
import numpy as np
import pytest
from conftest import run

import node_code

EDGE_SHARE = 1e-4  # texels on the edge of a flake: sines of two compilers differ in the last bit
ROUNDING = 1e-5  # of normals, by their image
STEEPEST = np.sin(np.radians(85))  # flakes of the map are not steeper


@pytest.fixture(scope="module")
def node(tmp_path_factory):
    return node_code.compiled(tmp_path_factory.mktemp("node"))


def share_that_differs(normals, expected):
    sine = np.linalg.norm(expected, axis=-1, keepdims=True)
    expected = np.where(sine > STEEPEST, expected * STEEPEST / np.maximum(sine, STEEPEST), expected)
    return (np.abs(normals - expected).max(-1) > ROUNDING).mean()


def normals_of(folder, options):
    run(folder, f"synth flake2d {options} -o n.exr", "ingest n.exr -o n.glint")
    with h5py.File(folder / "n.glint") as file:
        return np.array(file["normals"])


@pytest.mark.parametrize(
    "width, height, size, roughness, coverage",
    [
        (512, 512, 0.033, 0.3, 0.5),
        (300, 500, 0.0123, 0.6, 0.95),
        (400, 200, 0.21, 0.15, 0.2),
    ],
)
def test_texels_are_those_of_the_node(node, tmp_path, width, height, size, roughness, coverage):
    normals = normals_of(
        tmp_path, f"--size {width}x{height} --flake-size-uv {size} --roughness {roughness} --coverage {coverage}"
    )
    presence, expected = node_code.evaluate(node, width, height, size, roughness, coverage)
    assert (presence > 0).mean() == pytest.approx(coverage, abs=0.1)
    assert share_that_differs(normals, expected) < EDGE_SHARE


def test_seeds_are_planes_of_flake3d(node, tmp_path):
    normals = normals_of(tmp_path, "--size 256 --flake-size-uv .125 --roughness .4 --coverage .6 --seed 5")
    _, expected = node_code.evaluate(node, 256, 256, 0.125, 0.4, 0.6, z=4 * 0.125)
    cell = 32  # texels; cells at the border are others, so that the map tiles
    inside = np.s_[cell:-cell, cell:-cell]
    assert share_that_differs(normals[inside], expected[inside]) < EDGE_SHARE
