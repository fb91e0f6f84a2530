"""glint-info, glint-validate and glint-compress: what they print, and their exit codes."""

import json
import shutil

import pytest


@pytest.fixture
def normals(glint):
    """A small asset of kind normals."""
    assert glint("synth", "isotropic", "--size", "64", "-o", "map.exr").returncode == 0
    assert glint("ingest", "map.exr", "-o", "normals.glint").returncode == 0
    return glint.folder / "normals.glint"


def damaged(path, name, change):
    """A copy of a file with its bytes changed."""
    copy = path.with_name(name)
    copy.write_bytes(change(bytearray(path.read_bytes())))
    return copy


def with_flipped_normal(glint, path):
    """A copy of an asset of normals with a bit of its last number flipped."""
    datasets = json.loads(glint("info", path, "--json").stdout)["result"]["datasets"]
    last = next(dataset["offset"] + dataset["bytes"] - 1 for dataset in datasets if dataset["path"] == "/normals")

    def flip(data):
        data[last] ^= 1
        return data

    return damaged(path, "bad.glint", flip)


def test_validate_is_silent_on_valid_files(glint, normals):
    process = glint("validate", normals)
    assert (process.returncode, process.stdout, process.stderr) == (0, "", "")


def test_validate_names_the_rule_of_a_changed_byte(glint, normals):
    bad = with_flipped_normal(glint, normals)
    process = glint("validate", normals, bad)
    assert process.returncode == 3
    assert "[dataset.hash]" in process.stdout and "bad.glint" in process.stdout
    files = json.loads(glint("validate", normals, bad, "--json").stdout)["result"]["files"]
    assert [file["valid"] for file in files] == [True, False]
    assert files[1]["findings"][0]["rule"] == "dataset.hash"
    assert glint("validate", bad, "--quick").returncode == 0  # structure only


def test_validate_exit_codes_by_cause(glint, normals):
    assert glint("validate", "missing.glint").returncode == 2
    truncated = damaged(normals, "short.glint", lambda data: data[: len(data) // 2])
    assert glint("validate", truncated).returncode == 3
    h5py = pytest.importorskip("h5py")
    newer = glint.folder / "newer.glint"
    shutil.copy(normals, newer)
    with h5py.File(newer, "r+") as file:
        file.attrs.modify("format_major", 2)
    process = glint("validate", newer)
    assert process.returncode == 5
    assert "2" in process.stdout and "1.0" in process.stdout


def test_info_says_kind_sizes_and_provenance(glint, normals):
    text = glint("info", normals).stdout
    assert "normals" in text and "64" in text and "glint-ingest" in text
    result = json.loads(glint("info", normals, "--json").stdout)["result"]
    assert result["kind"] == "normals"


def test_info_refuses_what_is_no_asset(glint, normals):
    (glint.folder / "text.glint").write_text("not an asset")
    process = glint("info", "text.glint")
    assert process.returncode == 3
    assert "text.glint" in process.stderr
    assert glint("info", "missing.glint").returncode == 2


def test_compress_refuses_other_kinds_and_writes_nothing(glint, normals):
    process = glint("compress", normals, "-o", "out.glint")
    assert process.returncode == 5
    assert "is of kind normals, not ndf-pyramid" in process.stderr
    assert not (glint.folder / "out.glint").exists()
    assert glint("compress", "missing.glint", "-o", "out.glint").returncode == 2
    assert glint("compress", normals, "-o", "no-such-folder/out.glint").returncode == 2


def test_compress_takes_a_rank_or_a_tolerance(glint, normals):
    process = glint("compress", normals, "-o", "out.glint", "--rank", "4", "--tolerance", "0.1")
    assert process.returncode == 1
    assert "--tolerance" in process.stderr
    assert glint("compress", normals, "-o", "out.glint", "--tolerance", "2").returncode == 1
