"""glint-ingest keeps arrays that do not fit on a disk, not in a folder that is memory itself."""

import os
import pathlib
import subprocess
import tempfile

import pytest
from conftest import BIN, run_all

SHM = pathlib.Path("/dev/shm")
LIMIT = "16M"  # less than the pixels and normals of the map


def ingest(glint, output, temporary, stdout=None):
    return subprocess.run(
        [BIN / "glint-ingest", "map.exr", "-o", output, "--max-memory", LIMIT, "--threads", "2"],
        cwd=glint.folder,
        env={**os.environ, "TMPDIR": str(temporary)},
        stdout=stdout,
        stderr=subprocess.PIPE,
        text=True,
    )


@pytest.fixture
def maps(glint):
    run_all(glint, "synth flakes --size 1024 -o map.exr")
    return glint


@pytest.fixture
def shm():
    mounts = pathlib.Path("/proc/mounts").read_text().splitlines()
    if not any(mount.split()[1:3] == [str(SHM), "tmpfs"] for mount in mounts) or not os.access(SHM, os.W_OK):
        pytest.skip("there is no folder in memory")
    with tempfile.TemporaryDirectory(dir=SHM) as folder:
        yield pathlib.Path(folder)


def test_arrays_of_outputs_in_memory_are_in_the_folder_for_temporary_files(maps, shm):
    process = ingest(maps, shm / "map.glint", maps.folder / "none")
    assert process.returncode == 2 and str(maps.folder / "none") in process.stderr
    process = ingest(maps, shm / "map.glint", shm)
    assert process.returncode == 0 and f"{shm}: temporary files of this run were in memory" in process.stderr


def test_arrays_of_pipes_are_in_the_folder_for_temporary_files(maps, shm):
    with subprocess.Popen(["cat"], stdin=subprocess.PIPE, stdout=subprocess.DEVNULL) as reader:
        process = ingest(maps, "/dev/stdout", shm, stdout=reader.stdin)
    assert process.returncode == 0 and "were in memory" in process.stderr


def test_other_arrays_are_beside_the_output(maps):
    process = ingest(maps, "map.glint", maps.folder / "none")
    assert process.returncode == 0 and "were in memory" not in process.stderr
