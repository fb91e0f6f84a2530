"""glint-synth."""

import json
import time
import signal
import subprocess

import pytest
from conftest import BIN

KINDS = ["isotropic", "brushed", "flakes", "scratches", "leather", "weave", "sawtooth", "flat", "grating"]


@pytest.mark.parametrize("kind", KINDS)
def test_every_kind_is_ingested(glint, kind):
    assert glint("synth", kind, "--size", "64x48", "-o", "a.exr").returncode == 0
    allow = ["--allow-constant"] if kind == "flat" else []
    process = glint("ingest", "a.exr", "-o", "a.glint", "--json", *allow)
    assert process.returncode == 0, process.stderr
    report = json.loads(process.stdout)["result"]
    assert report["texels"] == 64 * 48
    assert report["non_unit"] == report["downward"] == report["non_finite"] == 0


def test_success_is_silent(glint):
    process = glint("synth", "flakes", "--size", "8", "-o", "a.png")
    assert (process.returncode, process.stdout, process.stderr) == (0, "", "")


def test_same_bytes_for_any_number_of_threads(glint):
    for threads in (1, 2):
        glint("synth", "isotropic", "--size", "100x60", "-o", f"{threads}.exr", "--threads", threads)
    assert (glint.folder / "1.exr").read_bytes() == (glint.folder / "2.exr").read_bytes()


def test_heights_give_the_same_normals(glint):
    glint("synth", "isotropic", "--size", "64", "-o", "n.exr")
    glint("synth", "isotropic", "--size", "64", "-o", "h.exr", "--height")
    direct = json.loads(glint("ingest", "n.exr", "-o", "n.glint", "--json").stdout)["result"]["slope_covariance"]
    derived = json.loads(glint("ingest", "h.exr", "--kind", "height", "-o", "h.glint", "--json").stdout)["result"]
    # Encoding to 0..1 rounds normals to 6e-8.
    assert derived["slope_covariance"]["xx"] == pytest.approx(direct["xx"], rel=1e-5)


@pytest.mark.parametrize(
    "arguments, code",
    [
        (["flakse", "-o", "a.exr"], 1),
        (["flakes"], 1),
        (["flakes", "-o", "a.exr", "--size", "8y8"], 1),
        (["flakes", "-o", "a.exr", "--size", "0"], 1),
        (["flakes", "-o", "a.exr", "--size", "99999999999"], 1),
        (["flakes", "-o", "a.exr", "--alpha", "3"], 1),
        (["flakes", "-o", "a.nonsense"], 1),
        (["flakes", "-o", "a.png", "--bits", "32"], 1),
        (["isotropic", "-o", "a.png", "--height"], 1),
        (["flakes", "-o", "no/such/folder/a.exr"], 2),
        (["flakes", "-o", "a.exr", "--height"], 5),
    ],
)
def test_wrong_use_is_refused_and_leaves_nothing(glint, arguments, code):
    process = glint("synth", *arguments, *([] if "--size" in arguments else ["--size", "8"]))
    assert process.returncode == code, process.stderr
    assert process.stderr.startswith("glint-synth: error: ")
    assert list(glint.folder.iterdir()) == []


@pytest.mark.parametrize("delay_s", [0.02, 0.3, 0.6])
def test_a_killed_run_leaves_no_output(glint, delay_s):
    command = [BIN / "glint-synth", "leather", "--size", "4096", "-o", "a.exr"]
    process = subprocess.Popen(command, cwd=glint.folder)
    time.sleep(delay_s)
    process.send_signal(signal.SIGKILL)
    assert process.wait() == -signal.SIGKILL
    assert not (glint.folder / "a.exr").exists()
