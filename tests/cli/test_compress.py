"""glint-compress as a pipeline runs it."""

import json
import pathlib

import pytest

SAMPLES = pathlib.Path(__file__).parents[2] / "data-samples"


@pytest.mark.parametrize("tolerance", [0.05, 0.025, 0.012])
@pytest.mark.parametrize("sample", ["scratches_256", "brushed_256"])
def test_every_level_meets_a_tolerance(glint, sample, tolerance):
    glint("ingest", SAMPLES / f"{sample}.png", "-o", "map.glint")
    glint("pyramid", "map.glint", "-o", "map.pyramid.glint")
    process = glint("compress", "map.pyramid.glint", "-o", "map.cp.glint", "--method", "tucker", "--tolerance", tolerance, "--json")
    assert process.returncode == 0, process.stderr
    result = json.loads(process.stdout)["result"]
    assert 0.98 * tolerance <= result["total"]["rel_l2"] <= tolerance
    *own, third, mean = result["levels"]
    assert len(own) == 2, "each is a group of its own"
    for level in own:
        assert level["rel_l2"] <= tolerance
    # The third level shares a group with the mean of the map, whose single image is easier.
    assert mean["rel_l2"] <= third["rel_l2"] <= 1.1 * tolerance
