"""glint-binmap, and bin maps behind glint-query."""

import json
import math

import pytest

ALPHA = 0.05
# Normals are kept to 1/256 of a bin at this size.
DENSITY_TOLERANCE = 0.01
BOXES = [
    ["--box", "12", "3", "-4", "9"],
    ["--box", "40", "0", "0", "25"],
    ["--box", "0.4", "0", "0", "0.3"],
    ["--box", "300", "0", "20", "200"],
]


@pytest.fixture(scope="module")
def assets(tmp_path_factory):
    import subprocess

    from conftest import BIN

    folder = tmp_path_factory.mktemp("binmap")

    def run(name, *arguments):
        subprocess.run([str(BIN / f"glint-{name}"), *map(str, arguments)], cwd=folder, check=True, timeout=120)

    run("synth", "isotropic", "--size", "128", "--alpha", "0.3", "-o", "map.exr")
    run("ingest", "map.exr", "-o", "map.glint")
    run("binmap", "map.glint", "-o", "bins.glint", "--alpha", ALPHA)
    return folder


def number(process):
    assert process.returncode == 0, process.stderr
    return float(process.stdout)


@pytest.mark.parametrize("box", BOXES, ids=" ".join)
@pytest.mark.parametrize("question", [["--half", "0.05", "-0.1"], ["--range", "0", "-0.1", "0.1", "0.2"]], ids=lambda q: q[0])
def test_answers_are_those_of_brute_force(glint, assets, box, question):
    footprint = ["--uv", "0.97", "0.3", *box]
    expected = number(glint("query", assets / "map.glint", *footprint, *question, "--sigma-r", repr(ALPHA / math.sqrt(2))))
    answer = number(glint("query", assets / "bins.glint", *footprint, *question))
    assert answer == pytest.approx(expected, rel=DENSITY_TOLERANCE, abs=1e-3)


def test_large_footprints_see_their_own_normals_where_these_vary_over_the_map(glint):
    alpha, merged_error = 0.22, 0.015
    assert (
        glint("synth", "sawtooth", "--size", "512", "--feature-size", "256", "--slope", "0.08", "-o", "s.exr").returncode == 0
    )
    assert glint("ingest", "s.exr", "-o", "s.glint").returncode == 0
    assert glint("binmap", "s.glint", "-o", "b.glint", "--alpha", alpha).returncode == 0
    question = ["--uv", "0.45", "0.5", "--box", "16", "0", "0", "16", "--half", "-0.0267", "0"]
    expected = number(glint("query", "s.glint", *question, "--sigma-r", repr(alpha / math.sqrt(2))))
    assert expected == pytest.approx(5.20, rel=0.005)
    assert number(glint("query", "b.glint", *question)) == pytest.approx(expected, rel=merged_error)


def test_files_are_valid_small_and_do_not_depend_on_threads(glint, assets):
    for threads in ("1", "2"):
        process = glint("binmap", assets / "map.glint", "-o", f"b{threads}.glint", "--alpha", ALPHA, "--threads", threads)
        assert (process.returncode, process.stdout, process.stderr) == (0, "", "")
    assert (glint.folder / "b1.glint").read_bytes() == (glint.folder / "b2.glint").read_bytes()
    assert glint("validate", "b1.glint").returncode == 0
    header = 40_000  # of HDF5, at most
    assert (glint.folder / "b1.glint").stat().st_size < 6 * 128 * 128 + header


def test_json_says_what_was_built(glint, assets):
    process = glint("binmap", assets / "map.glint", "-o", "b.glint", "--alpha", ALPHA, "--leaf-size", "2", "--json")
    result = json.loads(process.stdout)["result"]
    assert result["bins_per_axis"] == int(5 / math.sin(math.atan(3 * ALPHA / math.sqrt(2))))
    assert 0 < result["blocks"] <= result["cells"]
    info = json.loads(glint("info", "b.glint", "--json").stdout)["result"]
    # The map's noise has slopes of alpha / sqrt(2) along each axis.
    assert info["properties"]["slope_covariance"]["xx"] == pytest.approx(0.3**2 / 2, rel=0.2)
    summary = json.dumps(info)
    assert f'"blocks": {result["blocks"]}' in summary


def test_a_range_of_roughnesses_is_one_asset(glint, assets):
    assert glint("binmap", assets / "map.glint", "-o", "range.glint", "--alpha", "0.02:0.1").returncode == 0
    assert glint("validate", "range.glint").returncode == 0
    info = json.loads(glint("info", "range.glint", "--json").stdout)["result"]
    assert [info["properties"][key] for key in ("alpha_min", "alpha_max")] == pytest.approx([0.02, 0.1])
    question = ["--uv", "0.97", "0.3", "--box", "12", "3", "-4", "9", "--half", "0.05", "-0.1"]
    for alpha in (0.02, 0.05, 0.1):
        expected = number(glint("query", assets / "map.glint", *question, "--sigma-r", repr(alpha / math.sqrt(2))))
        answer = number(glint("query", "range.glint", *question, "--alpha", alpha))
        assert answer == pytest.approx(expected, rel=DENSITY_TOLERANCE, abs=1e-3), alpha
    smallest = number(glint("query", "range.glint", *question))
    assert smallest == number(glint("query", "range.glint", *question, "--alpha", "0.02"))
    refused = glint("query", "range.glint", *question, "--alpha", "0.2")
    assert refused.returncode == 1 and "0.02" in refused.stderr and "0.1" in refused.stderr
    assert glint("query", assets / "bins.glint", *question, "--alpha", "0.1").returncode == 1


def test_published_densities_are_of_the_centres_of_bins(glint, assets):
    question = ["--uv", "0.3", "0.6", "--box", "20", "0", "0", "20", "--half", "0.05", "0.02"]
    exact = number(glint("query", assets / "bins.glint", *question))
    published = number(glint("query", assets / "bins.glint", *question, "--estimator", "published"))
    assert published != exact
    assert published == pytest.approx(exact, rel=0.3)
    assert number(glint("query", assets / "bins.glint", *question, "--estimator", "exact")) == exact
    assert "--estimator has no effect" in glint("query", assets / "map.glint", *question, "--estimator", "published").stderr


@pytest.mark.parametrize("alpha", ["0.1:0.05", "0.1:", ":0.1", "0.1:2", "0.001:0.1", "0.1:x", "0.1-0.2", "0.1:0"])
def test_bad_ranges_are_usage_errors(glint, assets, alpha):
    process = glint("binmap", assets / "map.glint", "-o", "b.glint", "--alpha", alpha)
    assert process.returncode == 1 and "--alpha" in process.stderr, process.stderr


@pytest.mark.parametrize(
    "options",
    [
        ["--alpha", ""],
        ["--alpha", "0"],
        ["--alpha", "-0.1"],
        ["--alpha", "1e9"],
        ["--alpha", "nan"],
        ["--alpha", "0.1", "--leaf-size", "0"],
    ],
    ids=" ".join,
)
def test_options_out_of_range_are_usage_errors(glint, assets, options):
    process = glint("binmap", assets / "map.glint", "-o", "b.glint", *options)
    assert process.returncode == 1, process.stderr
    assert "--" in process.stderr
    assert not (glint.folder / "b.glint").exists()


def test_reads_normals_only(glint, assets):
    assert glint("binmap", assets / "bins.glint", "-o", "b.glint", "--alpha", ALPHA).returncode == 5


@pytest.mark.parametrize("size", [1, 5])
def test_tiny_and_constant_maps_work(glint, size):
    assert glint("synth", "flat", "--size", size, "-o", "flat.exr").returncode == 0
    assert glint("ingest", "flat.exr", "-o", "flat.glint", "--allow-constant").returncode == 0
    assert glint("binmap", "flat.glint", "-o", "b.glint", "--alpha", "0.1").returncode == 0
    assert glint("validate", "b.glint").returncode == 0
    answer = number(glint("query", "b.glint", "--uv", "0.5", "0.5", "--box", "9", "2", "-3", "5", "--half", "0", "0"))
    assert answer == pytest.approx(1 / (math.pi * 0.1**2), rel=DENSITY_TOLERANCE)
