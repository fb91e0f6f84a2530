"""glint-ingest."""

import json

import pytest


@pytest.fixture
def flakes(glint):
    assert glint("synth", "flakes", "--size", "32", "-o", "flakes.png").returncode == 0
    return "flakes.png"


def test_success_is_silent_and_repeatable(glint, flakes):
    process = glint("ingest", flakes, "-o", "a.glint")
    assert (process.returncode, process.stdout, process.stderr) == (0, "", "")
    first = (glint.folder / "a.glint").read_bytes()
    assert glint("ingest", flakes, "-o", "a.glint", "--threads", "1").returncode == 0
    assert (glint.folder / "a.glint").read_bytes() == first


def test_verbose_prints_the_report(glint, flakes):
    process = glint("ingest", flakes, "-o", "a.glint", "-v")
    assert "slope covariance" in process.stdout


def test_the_seed_changes_the_dither_only(glint, flakes):
    glint("ingest", flakes, "-o", "a.glint", "--seed", "1")
    glint("ingest", flakes, "-o", "b.glint", "--seed", "2")
    assert (glint.folder / "a.glint").read_bytes() != (glint.folder / "b.glint").read_bytes()


def test_truncated_image_is_invalid_input(glint, flakes):
    whole = (glint.folder / flakes).read_bytes()
    (glint.folder / "cut.png").write_bytes(whole[: len(whole) // 2])
    process = glint("ingest", "cut.png", "-o", "a.glint", "--json")
    assert process.returncode == 3
    assert json.loads(process.stdout)["error"]["rule"] == "image.complete"
    assert not (glint.folder / "a.glint").exists()


def test_heights_given_as_normals_are_refused_with_the_remedy(glint):
    glint("synth", "isotropic", "--size", "16", "-o", "h.exr", "--height")
    process = glint("ingest", "h.exr", "-o", "a.glint")
    assert process.returncode == 3
    assert "--kind height" in process.stderr


def test_flat_map_needs_consent(glint):
    glint("synth", "flat", "--size", "16", "-o", "flat.exr")
    assert glint("ingest", "flat.exr", "-o", "a.glint").returncode == 3
    assert glint("ingest", "flat.exr", "-o", "a.glint", "--allow-constant").returncode == 0


@pytest.mark.parametrize(
    "options",
    [
        ["--to", "heights"],
        ["--height-scale-um", "3"],
        ["--height-scale-um", "3", "--texel-size-um", "2", "--height-scale", "2"],
        ["--convention", "vulkan"],
        ["--texel-size-um", "-1"],
    ],
)
def test_options_that_contradict_are_usage_errors(glint, flakes, options):
    process = glint("ingest", flakes, "-o", "a.glint", *options)
    assert process.returncode == 1, process.stderr


def test_scale_in_micrometres_is_relative_to_the_texel(glint):
    glint("synth", "isotropic", "--size", "32", "-o", "h.exr", "--height")
    common = ["ingest", "h.exr", "--kind", "height", "--json", "--texel-size-um", "4", "-o"]
    micrometres = json.loads(glint(*common, "a.glint", "--height-scale-um", "8").stdout)["result"]
    texels = json.loads(glint(*common, "b.glint", "--height-scale", "2").stdout)["result"]
    assert micrometres == texels


def test_output_of_another_kind_needs_force(glint, flakes):
    assert glint("ingest", flakes, "-o", flakes).returncode == 1
    (glint.folder / "letter").write_text("dear friend")
    assert glint("ingest", flakes, "-o", "letter").returncode == 1
    assert (glint.folder / "letter").read_text() == "dear friend"
    assert glint("ingest", flakes, "-o", "letter", "--force").returncode == 0
