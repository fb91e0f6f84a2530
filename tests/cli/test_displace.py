"""glint-displace."""

import json

import h5py
import numpy
import pytest


@pytest.fixture
def heights(glint):
    assert glint("synth", "weave", "--size", "64x96", "-o", "h.exr", "--height").returncode == 0
    assert glint("ingest", "h.exr", "--kind", "height", "--to", "heights", "-o", "h.glint").returncode == 0
    return "h.glint"


QUICK = ["--angular", "5", "--spatial", "2"]


def test_levels_are_written_and_valid(glint, heights):
    process = glint("displace", heights, "-o", "d.glint", "--factors", "4,16", "--json", *QUICK)
    assert process.returncode == 0, process.stderr
    levels = json.loads(process.stdout)["result"]["levels"]
    assert [(level["factor"], level["columns"], level["rows"]) for level in levels] == [(4, 16, 24), (16, 4, 6)]
    assert all(level["interreflected_share"] > 0.01 for level in levels)
    assert glint("validate", "d.glint").returncode == 0
    info = json.loads(glint("info", "d.glint", "--json").stdout)
    assert "displacement" in json.dumps(info)


def test_same_bytes_for_any_number_of_threads(glint, heights):
    for threads in (1, 2):
        assert glint("displace", heights, "-o", f"{threads}.glint", "--threads", threads, "--quiet", *QUICK).returncode == 0
    assert (glint.folder / "1.glint").read_bytes() == (glint.folder / "2.glint").read_bytes()


def test_specification_is_enough_to_read_the_model(glint, heights):
    glint("displace", heights, "-o", "d.glint", "--factor", "8", "--base", "ggx:0.3", "--quiet", *QUICK)
    with h5py.File(glint.folder / "d.glint") as file:
        assert file.attrs["base"] == b"ggx"
        level = file["level_00"]
        lobes = level["lobes"][...]
        assert lobes.shape == (12, 8, 6, 4)
        # The area of the surface over its projected area, from the heights themselves.
        with h5py.File(glint.folder / "h.glint") as source:
            h = source["heights"][...].astype(float)
        right, up = numpy.roll(h, -1, 1), numpy.roll(h, -1, 0)
        both = numpy.roll(right, -1, 0)
        area = numpy.mean(0.5 * (numpy.hypot(1, numpy.hypot(right - h, up - h)) + numpy.hypot(1, numpy.hypot(both - up, both - right))))
        assert lobes[..., 3].sum(axis=-1).mean() == pytest.approx(area, rel=1e-4)
        assert level["angular_scale"].shape == (25 * 26 // 2,)
        assert level["heights"][...].mean() == pytest.approx(h.mean(), abs=1e-3)


def test_shadowing_alone_is_darker_than_interreflections(glint, heights):
    scale = {}
    for bounces in ("1", "auto"):
        glint("displace", heights, "-o", f"{bounces}.glint", "--base", "diffuse:1", "--bounces", bounces, "--quiet", *QUICK)
        with h5py.File(glint.folder / f"{bounces}.glint") as file:
            scale[bounces] = file["level_00/angular_scale"][...].astype(float).mean()
    assert scale["1"] < 0.97 * scale["auto"]


def test_warns_of_distant_interreflections(glint):
    """The paper's failure (Fig. 19): relief that is deep compared with a cell."""
    glint("synth", "sawtooth", "--size", "64", "--feature-size", "32", "--slope", "3", "-o", "deep.exr", "--height")
    glint("ingest", "deep.exr", "--kind", "height", "--to", "heights", "-o", "deep.glint")
    process = glint("displace", "deep.glint", "-o", "d.glint", "--factor", "4", *QUICK)
    assert process.returncode == 0
    assert "hops farther than a cell" in process.stderr
    glint("synth", "isotropic", "--size", "64", "--alpha", "0.3", "-o", "shallow.exr", "--height")
    glint("ingest", "shallow.exr", "--kind", "height", "--to", "heights", "-o", "shallow.glint")
    assert "hops" not in glint("displace", "shallow.glint", "-o", "d.glint", "--factor", "32", *QUICK).stderr


@pytest.mark.parametrize(
    "options, code, message",
    [
        (["--factor", "5"], 3, "does not divide 64 x 96"),
        (["--factor", "1"], 1, ""),
        (["--factors", "16,4"], 1, "ascending"),
        (["--factor", "4", "--factors", "4,8"], 1, ""),
        (["--base", "diffuse:1.5"], 1, "gain"),
        (["--base", "diffuse:0"], 1, "absorb"),
        (["--base", "diffuse"], 1, "diffuse:RHO"),
        (["--base", "ggx:0.3:1.5"], 1, "ETA,K"),
        (["--base", "ggx:0.001"], 1, "roughness"),
        (["--base", "velvet:1"], 1, "no known reflectance"),
        (["--bounces", "0"], 1, "auto"),
        (["--bounces", "many"], 1, "auto"),
        (["--lobes", "7"], 1, ""),
    ],
)
def test_wrong_use_is_refused_and_leaves_nothing(glint, heights, options, code, message):
    process = glint("displace", heights, "-o", "d.glint", *options)
    assert process.returncode == code, process.stderr
    assert message in process.stderr
    assert not (glint.folder / "d.glint").exists()


def test_slopes_beyond_80_degrees_are_refused(glint):
    glint("synth", "isotropic", "--size", "32", "--alpha", "1", "-o", "h.exr", "--height")
    glint("ingest", "h.exr", "--kind", "height", "--to", "heights", "--height-scale", "50", "-o", "h.glint")
    process = glint("displace", "h.glint", "-o", "d.glint", "--factor", "8")
    assert process.returncode == 3
    assert "steeper than 80 degrees" in process.stderr


def test_flat_maps_are_left_alone(glint):
    glint("synth", "flat", "--size", "32", "-o", "h.exr", "--height")
    assert glint("ingest", "h.exr", "--kind", "height", "--to", "heights", "-o", "h.glint", "--allow-constant").returncode == 0
    assert glint("displace", "h.glint", "-o", "d.glint", "--factor", "8", *QUICK).returncode == 0
    with h5py.File(glint.folder / "d.glint") as file:
        assert numpy.allclose(file["level_00/angular_scale"][...], 1, atol=2e-3)
        assert numpy.allclose(file["level_00/spatial_scale"][...], 1, atol=1e-4)
