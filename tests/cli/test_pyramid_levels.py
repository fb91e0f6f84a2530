"""glint-pyramid --finest and --coarsest: levels that no footprint asks for are left out."""

import json

import pytest
from conftest import run_all

FOOTPRINT_PER_STRIDE = 0.433
SMALLEST_OVER_LEVEL, LARGEST_OVER_LEVEL = 1.2, 1.9  # sizes that a level answers by itself


def levels_of(glint, *flags):
    process = glint(
        "pyramid", "map.glint", "-o", "pyramid.glint", "--resolution", "32", "--sigma-r", "0.05", "--force", "--json", *flags
    )
    assert process.returncode == 0, process.stderr
    return json.loads(process.stdout)["result"]["levels"]


@pytest.fixture
def map_glint(glint):
    run_all(glint, "synth flakes --size 256 -o map.png", "ingest map.png -o map.glint")
    return glint


def test_levels_are_those_of_the_footprints(map_glint):
    levels = [level for level in levels_of(map_glint, "--finest", "8", "--coarsest", "20") if not level["is_mean"]]
    sizes = [FOOTPRINT_PER_STRIDE * level["stride_texels"] for level in levels]
    assert (
        SMALLEST_OVER_LEVEL * sizes[0] <= 8 < 2 * SMALLEST_OVER_LEVEL * sizes[0]
    ), "level 0 answers the smallest footprint, and no finer level does"
    assert (
        LARGEST_OVER_LEVEL * sizes[-1] >= 20 > LARGEST_OVER_LEVEL * sizes[-1] / 2
    ), "the last level answers the largest footprint, and is needed"


def test_fewer_levels_take_fewer_bytes(map_glint):
    size = lambda *flags: sum(level["size_bytes"] for level in levels_of(map_glint, *flags))
    assert size("--finest", "8") < size("--finest", "4")
    assert size("--finest", "4", "--coarsest", "4") < size("--finest", "4", "--coarsest", "40")


@pytest.mark.parametrize(
    "flags, text",
    [
        (["--finest", "8", "--stride", "16"], "excludes"),
        (["--coarsest", "8", "--levels", "2"], "excludes"),
        (["--finest", "0"], "--finest"),
    ],
)
def test_wrong_use_is_refused(map_glint, flags, text):
    process = map_glint("pyramid", "map.glint", "-o", "pyramid.glint", *flags)
    assert process.returncode == 1 and text in process.stderr


def test_footprints_below_the_finest_level_need_the_map(map_glint):
    levels = levels_of(map_glint, "--finest", "8")
    ask = lambda sigma, *more: map_glint(
        "query", "pyramid.glint", "--uv", ".4", ".6", "--sigma", sigma, "--half", ".1", ".1", "--json", *more
    )
    refused = json.loads(ask("2").stdout)["error"]
    assert f"below the finest level, {FOOTPRINT_PER_STRIDE * levels[0]['stride_texels']:.2g} texels" in refused["message"]
    assert "--normals" in refused["remedy"]
    assert ask("2", "--normals", "map.glint").returncode == 0
    assert json.loads(ask("8").stdout)["result"]["widened"] is False, "a footprint that was asked for is answered as it is"
