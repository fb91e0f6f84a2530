"""Builders estimate their memory before they work, and refuse more than --max-memory with a remedy that works."""

import os
import re
import subprocess

import pytest
from conftest import BIN

SIZE = 512
UNITS = {"bytes": 1, "KB": 1 << 10, "MB": 1 << 20, "GB": 1 << 30, "TB": 1 << 40}
PROGRAM = 180 << 20  # bytes that a program takes with its libraries and threads before it works; OpenImageIO alone has 130 MB

# Command line, and the same with a remedy of its message that needs less.
RUNS = {
    "synth": ("synth isotropic --size 2048 -o out.exr", "synth isotropic --size 128 -o out.exr"),
    "ingest": ("ingest large.exr -o out.glint", "ingest map.exr -o out.glint"),
    "pyramid": ("pyramid map.glint -o out.glint --stride 4", "pyramid map.glint -o out.glint --stride 64"),
    "smooth": ("pyramid map.glint -o out.glint --stride 8 --surface smooth", "pyramid map.glint -o out.glint --stride 64 --surface smooth"),
    "compress": ("compress pyramid.glint -o out.glint --rank 4", "compress coarse.glint -o out.glint --rank 4"),
    "binmap": ("binmap large.glint -o out.glint", "binmap map.glint -o out.glint"),
    "sat": ("sat large.glint -o out.glint --bins 64x32 --stride 4", "sat large.glint -o out.glint --bins 9x16 --stride 64"),
    "moments": ("moments large.glint -o out.glint", "moments map.glint -o out.glint"),
    "tiny": ("tiny map.glint -o out.glint --cut 256", "tiny map.glint -o out.glint --cut 16"),
    "explicit": ("wang tiles.glint -o out.glint --explicit 4096 4096", "wang tiles.glint -o out.glint --explicit 64 64"),
    "wang": ("wang map.glint -o out.glint --size 256", "wang map.glint -o out.glint --size 32"),
    "displace": ("displace heights.glint -o out.glint --factor 16 --base diffuse:0.8", None),
    "shlobes": ("shlobes --sigma-r 0.05 --order 200 -o out.glint", "shlobes --sigma-r 0.05 --order 20 -o out.glint"),
}


def run(folder, line, *more):
    words = line.split()
    process = subprocess.Popen([BIN / f"glint-{words[0]}", *words[1:], "--threads", "2", *more], cwd=folder, stdout=subprocess.PIPE,
                               stderr=subprocess.PIPE, text=True)
    _, error = process.communicate(timeout=120)
    return process.returncode, error


def peak(folder, line):
    """Bytes that the command takes at its peak, those of mapped files included."""
    words = line.split()
    pid = os.spawnv(os.P_NOWAIT, BIN / f"glint-{words[0]}", [f"glint-{words[0]}", *words[1:], "--threads", "2"])
    _, status, usage = os.wait4(pid, 0)
    assert status == 0, line
    return usage.ru_maxrss << 10


def bytes_of(text):
    number, unit = text.split()
    return float(number) * UNITS[unit]


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    path = tmp_path_factory.mktemp("memory")
    for line in (f"synth isotropic --size {SIZE} -o map.exr", "ingest map.exr -o map.glint", "synth isotropic --size 2048 -o large.exr",
                 "ingest large.exr -o large.glint", f"synth isotropic --height --size {SIZE} -o heights.exr",
                 "ingest heights.exr --kind height --to heights -o heights.glint", "pyramid map.glint -o pyramid.glint --stride 8",
                 "pyramid map.glint -o coarse.glint --stride 128", "wang map.glint -o tiles.glint --size 32"):
        assert run(path, line)[0] == 0, line
    return path


@pytest.mark.parametrize("name", RUNS)
def test_too_little_memory_is_refused_before_the_work(folder, name, monkeypatch):
    line, smaller = RUNS[name]
    (folder / "out.glint").unlink(missing_ok=True)
    (folder / "out.exr").unlink(missing_ok=True)
    little = {"shlobes": "8M", "ingest": "60M"}.get(name, "2M")  # the pixels of the image alone take 48 MB
    code, error = run(folder, line, "--max-memory", little)
    assert code == 4, error
    assert "memory" in error or "a table" in error
    assert "--max-memory" in error and not {"out.glint", "out.exr"} & set(os.listdir(folder))
    # The message says how much; the run then has enough, and takes no more.
    said = re.search(r"(?:take|needs) (?:about )?([\d.]+ (?:bytes|[KMGT]B))", error)
    assert said, error
    need = bytes_of(said[1])
    code, error = run(folder, line, "--max-memory", said[1].replace(" bytes", "").replace(" ", "") if name != "shlobes" else str(int(need * 1.2)))
    assert code == 0, error
    monkeypatch.chdir(folder)
    taken = peak(folder, line + " --force")
    assert taken <= need + PROGRAM, f"takes {taken >> 20} MB, said {said[1]}"
    if smaller is not None:
        enough = max(need / 2, 1 << 20)
        code, error = run(folder, smaller + " --force", "--max-memory", str(int(enough)))
        assert code == 0, error


def test_sizes_have_units(folder):
    for text in ("64M", "64m", "0.5G", "65536K", "67108864", "64MiB", "64MB"):
        assert run(folder, "binmap map.glint -o sized.glint", "--max-memory", text)[0] == 0, text
    for text in ("", "-1", "64X", "G", "0", "nan", "1e30T"):
        code, error = run(folder, "binmap map.glint -o sized.glint", "--max-memory", text)
        assert code == 1 and "--max-memory" in error, text


def test_the_default_is_what_limits_leave(folder):
    """A limit of the shell, as a batch system sets one, is respected before the work."""
    command = f"ulimit -v 2000000; {BIN}/glint-pyramid map.glint -o limited.glint --stride 2 --resolution 1024 --threads 1"
    process = subprocess.run(["bash", "-c", command], cwd=folder, capture_output=True, text=True, timeout=120)
    assert process.returncode == 4, process.stderr
    assert "--stride" in process.stderr and "would take" in process.stderr


@pytest.mark.parametrize("header, name", [(b"PF\n16000 16000\n-1.0\n", "a.pfm"), (b"P6\n30000 30000\n255\n", "a.ppm"), (b"Pf\n30000 9000\n-1.0\n", "b.pfm")])
def test_images_that_declare_more_than_they_hold_are_refused(folder, header, name):
    (folder / name).write_bytes(header.ljust(120, b"\0"))
    (folder / "out.glint").unlink(missing_ok=True)
    monitor = subprocess.run(["bash", "-c", f"ulimit -v 2000000; {BIN}/glint-ingest {name} -o out.glint --threads 1"], cwd=folder,
                             capture_output=True, text=True, timeout=60)
    assert monitor.returncode == 3, monitor.stderr
    assert "declares more pixels than the file can hold" in monitor.stderr
    assert not (folder / "out.glint").exists()


def test_pixels_that_need_more_than_may_be_used_are_refused(folder):
    code, error = run(folder, "ingest large.exr -o out2.glint", "--max-memory", "1M")
    assert code == 4 and "--max-memory" in error
    assert not (folder / "out2.glint").exists()
