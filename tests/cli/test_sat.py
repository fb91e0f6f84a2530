"""glint-sat, and glint-query and glint-info on what it makes."""

import json

import pytest
from conftest import run_once

# Shell answers are printed with nine digits.
PRINTED = 1e-6
BOX = ["--uv", "0.3", "0.7", "--box", "20", "0", "0", "12"]


@pytest.fixture
def normals(glint):
    run_once(glint, "synth isotropic --size 96 -o map.exr", "ingest map.exr -o n.glint")
    return glint.folder / "n.glint"


@pytest.fixture
def sat(glint, normals):
    process = glint("sat", normals, "-o", "s.glint", "--stride", "4")
    assert (process.returncode, process.stdout, process.stderr) == (0, "", "")
    return glint.folder / "s.glint"


def number(process):
    assert process.returncode == 0, process.stderr
    return float(process.stdout.split()[0])


def test_asset_is_valid_and_says_what_it_is(glint, sat):
    assert glint("validate", sat).returncode == 0
    summary = json.loads(glint("info", sat, "--json").stdout)["result"]
    assert summary["kind"] == "histogram-sat"
    assert [summary["properties"][key] for key in ("theta_bins", "phi_bins", "stride")] == [9, 32, 4]
    assert 1 < summary["properties"]["bin_count"] <= 288
    assert summary["properties"]["slope_covariance"]["xx"] > 0


def test_json_tells_the_bytes_of_the_file(glint, normals):
    result = json.loads(glint("sat", normals, "-o", "s.glint", "--bins", "6x20", "--json").stdout)["result"]
    assert result["directions"] == 120
    assert sum(result["tables"].values()) <= result["size_bytes"] < (glint.folder / "s.glint").stat().st_size


def test_answers_are_those_of_the_texels(glint, normals, sat):
    # Over a range of many bins what lies inside a bin matters little, and texels count by area in both.
    wide = ["--range", "-1", "-1", "1", "1"]
    assert number(glint("query", sat, *BOX, *wide)) == pytest.approx(0.25, rel=PRINTED)
    half = ["--range", "-0.9", "0", "0.9", "0.9"]
    exact = number(glint("query", normals, *BOX, *half, "--sigma-r", "0.001"))
    assert number(glint("query", sat, *BOX, *half)) == pytest.approx(exact, rel=0.02)


def test_strides_do_not_change_answers(glint, normals, sat):
    assert glint("sat", normals, "-o", "coarse.glint", "--stride", "37").returncode == 0
    question = [*BOX, "--half", "0.05", "0.08"]
    assert number(glint("query", sat, *question)) == pytest.approx(
        number(glint("query", "coarse.glint", *question)), rel=PRINTED
    )


def test_gaussian_boxes_change_gaussian_footprints_only(glint, sat):
    gaussian = ["--uv", "0.3", "0.7", "--sigma", "9", "--half", "0.05", "0.08"]
    assert number(glint("query", sat, *gaussian)) != number(glint("query", sat, *gaussian, "--gaussian-boxes", "3"))
    box = [*BOX, "--half", "0.05", "0.08"]
    assert number(glint("query", sat, *box)) == number(glint("query", sat, *box, "--gaussian-boxes", "3"))


def test_slanted_boxes_are_as_exact_as_asked(glint, normals, sat):
    slanted = ["--uv", "0.3", "0.7", "--box", "30", "17", "-17", "30", "--range", "0", "0", "0.9", "0.9"]
    exact = number(glint("query", normals, *slanted, "--sigma-r", "0.001"))
    ours = number(glint("query", sat, *slanted, "--slant-tolerance", "0"))
    assert ours == pytest.approx(exact, rel=0.02)
    strips = number(glint("query", sat, *slanted))
    assert strips != ours
    assert strips == pytest.approx(ours, rel=0.06)  # the default tolerance
    assert glint("query", sat, *slanted, "--slant-tolerance", "-1").returncode == 1


def test_bytes_do_not_depend_on_threads(glint, normals):
    assert glint("sat", normals, "-o", "a.glint", "--threads", "1").returncode == 0
    assert glint("sat", normals, "-o", "b.glint", "--threads", "4").returncode == 0
    assert (glint.folder / "a.glint").read_bytes() == (glint.folder / "b.glint").read_bytes()


@pytest.mark.parametrize("bins", ["1x1", "64x1", "1x256", "64x32"])
def test_extreme_bins_work(glint, normals, bins):
    assert glint("sat", normals, "-o", "s.glint", "--bins", bins).returncode == 0
    assert glint("validate", "s.glint").returncode == 0
    assert number(glint("query", "s.glint", *BOX, "--range", "-1", "-1", "1", "1")) == pytest.approx(0.25, rel=PRINTED)


@pytest.mark.parametrize(
    "flags",
    [
        ["--bins", "9"],
        ["--bins", "9x"],
        ["--bins", "x32"],
        ["--bins", "0x32"],
        ["--bins", "9x257"],
        ["--bins", "64x64"],
        ["--bins", "9x32x1"],
        ["--bins", "-9x32"],
        ["--stride", "0"],
        ["--stride", "129"],
        ["--stride", "4.5"],
    ],
)
def test_bad_options_are_usage_errors(glint, normals, flags):
    process = glint("sat", normals, "-o", "s.glint", *flags)
    assert process.returncode == 1
    assert flags[0] in process.stderr
    assert not (glint.folder / "s.glint").exists()


def test_other_kinds_are_refused_by_name(glint, sat):
    process = glint("sat", sat, "-o", "t.glint")
    assert process.returncode == 5
    assert "histogram-sat" in process.stderr and "normals" in process.stderr


def test_a_truncated_asset_is_refused(glint, sat):
    data = sat.read_bytes()
    (glint.folder / "short.glint").write_bytes(data[: len(data) // 2])
    assert glint("query", "short.glint", *BOX, "--half", "0", "0").returncode == 3
