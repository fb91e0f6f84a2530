"""Tests of stability: methods get no worse where they fail, and the documents say where that is.

After a change that makes figures better or adds a test, record them anew: glint-bench --stability --quick -o tests/stability/recorded.json --force
"""

import json
import os
import pathlib
import subprocess
import sys

import jsonschema
import pytest

HERE = pathlib.Path(__file__).parent
ROOT = HERE.parents[1]
BIN = pathlib.Path(os.environ.get("GLINT_BIN_DIR", ROOT / "build/bin")).resolve()
SCHEMA = json.loads((ROOT / "docs/json/files/stability-results.schema.json").read_text())
sys.path.insert(0, str(HERE))
from limits_section import BEGIN, END, failing, section  # noqa: E402

# Other compilers and processors round differently, and a place that is seen or not moves a figure by more than digits.
WORSE = 1.05
SMALL = 0.003


@pytest.fixture(scope="module")
def measured(tmp_path_factory):
    path = tmp_path_factory.mktemp("stability") / "results.json"
    process = subprocess.run(
        [BIN / "glint-bench", "--stability", "--quick", "-o", path], capture_output=True, text=True, timeout=800
    )
    assert process.returncode == 0, process.stderr
    assert not list(path.parent.glob("*.assets"))
    return json.loads(path.read_text())


def points_of(results):
    return {(test["name"], point["series"], point["x"]): point for test in results["tests"] for point in test["points"]}


def test_results_are_as_described(measured):
    jsonschema.Draft202012Validator(SCHEMA).validate(measured)


def test_no_method_gets_worse(measured):
    recorded, now = points_of(json.loads((HERE / "recorded.json").read_text())), points_of(measured)
    assert now.keys() == recorded.keys()
    worse = [
        (name, before["value"], now[name].get("value"))
        for name, before in recorded.items()
        if "value" in before and not now[name].get("value", float("inf")) <= WORSE * before["value"] + SMALL
    ]
    assert worse == []


def test_the_tests_can_see(measured):
    """Known answers: brute force over triangles is a pyramid's answer from them, boxes are a bin map's own, and one lobe is no two."""
    now = {name: point.get("value") for name, point in points_of(measured).items()}
    assert now["smooth", "pyramid, stride 32, --normals", 0.5] < 1e-3 < 0.5 < now["smooth", "pyramid, stride 32", 0.5]
    assert now["size", "bin map", 512] < 0.01 < 0.5 < now["size", "moments, finest level 1", 512]
    assert now["two-lobes", "moments, finest level 1", 0.5] > 0.5 > 0.01 > now["two-lobes", "bin map", 0.5]
    assert now["border", "bin map", 4] == pytest.approx(1, abs=0.01)
    assert now["factors", "1 x 1 patches", 2] < 1e-6 < now["factors", "8 x 8 patches", 2]
    assert now["ringing", "hann", 10] < now["ringing", "no window", 10]


def test_limits_say_where_each_method_fails():
    results = json.loads((ROOT / "docs/stability.json").read_text())
    jsonschema.Draft202012Validator(SCHEMA).validate(results)
    page = (ROOT / "docs/LIMITS.md").read_text()
    assert section(results) in page, "run `make stability`"
    assert page.count(BEGIN) == page.count(END) == 1
    names = subprocess.run([BIN / "glint-bench", "--help"], capture_output=True, text=True).stdout
    assert all(test["name"] in names for test in results["tests"])


def test_sentences_name_the_range():
    def test_of(*values):
        return {"tolerable": 1, "points": [{"series": "s", "x": x, "value": value} for x, value in enumerate(values)]}

    assert failing(test_of(0, 1, 1), "s") == ""
    assert failing(test_of(2, 2, 2), "s") == "everywhere"
    assert failing(test_of(0, 2, 2), "s") == "from 1 on"
    assert failing(test_of(2, 2, 0), "s") == "up to 1"
    assert failing(test_of(0, 2, 0, 2, 0), "s") == "at 1 and 3"
    missing = test_of(0, 0)
    del missing["points"][1]["value"]
    assert failing(missing, "s") == "from 1 on"
