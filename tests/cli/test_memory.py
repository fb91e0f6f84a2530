"""Builders estimate their memory before they work, and refuse more than --max-memory with a remedy that works."""

import os
import re
import struct
import subprocess
import sys

import pytest
from conftest import BIN

UNITS = {"bytes": 1, "KB": 1 << 10, "MB": 1 << 20, "GB": 1 << 30, "TB": 1 << 40}
MB = 1 << 20
# Bytes that a program takes with its libraries and threads before it works, at least and at most. OpenImageIO alone has 120 MB.
PLAIN, WITH_IMAGES = (16 * MB, 40 * MB), (130 * MB, 150 * MB)
MOST_EXCESS, SMALL = 3, 16 * MB  # an estimate is at most so many times what the work takes, or than this

# Command line; the same with a remedy of its message that needs less; an amount of memory that is too little.
RUNS = {
    "synth": ("synth isotropic --size 1024 -o out.exr", "synth isotropic --size 128 -o out.exr", "2M"),
    "pyramid": ("pyramid map.glint -o out.glint --stride 8", "pyramid map.glint -o out.glint --stride 64", "2M"),
    "smooth": (
        "pyramid map.glint -o out.glint --stride 16 --surface smooth",
        "pyramid map.glint -o out.glint --stride 64 --surface smooth",
        "2M",
    ),
    "wave": (
        "pyramid small-heights.glint -o out.glint --optics wave --stride 4 --resolution 64 --wavelengths 2 --coherence-um 6",
        "pyramid small-heights.glint -o out.glint --optics wave --stride 32 --resolution 64 --wavelengths 2 --coherence-um 6",
        "2M",
    ),
    "compress": ("compress pyramid.glint -o out.glint --rank 4", "compress coarse.glint -o out.glint --rank 4", "2M"),
    "moments": ("moments large.glint -o out.glint", "moments map.glint -o out.glint", "2M"),
    "textures": (
        "moments map.glint -o out.glint --textures textures",
        "moments small.glint -o out.glint --textures textures",
        "2M",
    ),
    "tiny": ("tiny middle.glint -o out.glint --cut 256", "tiny middle.glint -o out.glint --cut 16", "2M"),
    "explicit": ("wang tiles.glint -o out.glint --explicit 2048 2048", "wang tiles.glint -o out.glint --explicit 64 64", "2M"),
    "wang": ("wang middle.glint -o out.glint --size 256", "wang middle.glint -o out.glint --size 32", "2M"),
    "colours": ("wang middle.glint -o out.glint --size 64 --colors 5", "wang middle.glint -o out.glint --size 64", "2M"),
    "displace": ("displace heights.glint -o out.glint --factor 32 --base diffuse:0.8", None, "2M"),
    "finely": (
        "displace heights.glint -o out.glint --factor 4 --base diffuse:0.8",
        "displace heights.glint -o out.glint --factor 32 --base diffuse:0.8",
        "2M",
    ),
    "angular": (
        "displace relief.glint -o out.glint --factor 8 --base diffuse:0.8 --bounces 1 --angular 25 --spatial 4",
        "displace relief.glint -o out.glint --factor 8 --base diffuse:0.8 --bounces 1 --angular 15 --spatial 1",
        "2M",
    ),
    "shlobes": ("shlobes --sigma-r 0.05 --order 120 -o out.glint", "shlobes --sigma-r 0.05 --order 20 -o out.glint", "8M"),
    "light": (
        "shlobes --light lights.json --order 90 --grid 5x8 -o out.glint",
        "shlobes --light lights.json --order 20 --grid 5x8 -o out.glint",
        "2M",
    ),
    "picture": (
        "query map.glint --uv .5 .5 --sigma 4 --image out.exr --image-size 512",
        "query map.glint --uv .5 .5 --sigma 4 --image out.exr --image-size 64",
        "2M",
    ),
}
IMAGES = {"synth", "textures", "picture"}  # these load OpenImageIO
MAKE = [
    "synth isotropic --size 64 -o small.exr",
    "ingest small.exr -o small.glint",
    "synth isotropic --size 512 -o map.exr",
    "ingest map.exr -o map.glint",
    "synth isotropic --size 1024 -o middle.exr",
    "ingest middle.exr -o middle.glint",
    "synth flakes --size 2048 -o large.exr",
    "ingest large.exr -o large.glint",
    "synth isotropic --height --size 512 -o heights.exr",
    "ingest heights.exr --kind height --to heights -o heights.glint",
    "synth isotropic --height --size 128 -o small-heights.exr",
    "ingest small-heights.exr --kind height --to heights --texel-size-um 1 -o small-heights.glint",
    "synth weave --height --size 32 -o relief.exr",
    "ingest relief.exr --kind height --to heights -o relief.glint",
    "pyramid map.glint -o pyramid.glint --stride 16",
    "pyramid map.glint -o coarse.glint --stride 128",
    "wang map.glint -o tiles.glint --size 32",
]
LIGHTS = '{"lights": [{"type": "sphere", "centre": [0, 0, 5], "radius": 1, "radiance": [1, 1, 1]}]}'


def command_of(line, *more):
    words = line.split()
    return [BIN / f"glint-{words[0]}", *words[1:], "--threads", "2", *more]


def run(folder, line, *more):
    process = subprocess.run(command_of(line, *more), cwd=folder, capture_output=True, text=True, timeout=120)
    return process.returncode, process.stderr


# Runs a command, and prints the KiB that it had at its peak.
PARENT = """
import os, sys
pid = os.posix_spawn(sys.argv[1], sys.argv[1:], os.environ, file_actions=[(os.POSIX_SPAWN_OPEN, 1, "/dev/null", os.O_WRONLY, 0)])
_, status, usage = os.wait4(pid, 0)
print(usage.ru_maxrss)
sys.exit(os.waitstatus_to_exitcode(status))
"""


def peak(folder, line, *more):
    """Bytes that the command takes at its peak, those of mapped files included.

    The system counts what the parent had when the command began, so the parent is a small interpreter and not this one.
    """
    command = [sys.executable, "-S", "-E", "-c", PARENT, *map(str, command_of(line, *more))]
    process = subprocess.run(command, cwd=folder, capture_output=True, text=True, timeout=300)
    assert process.returncode == 0, process.stderr
    return int(process.stdout) << 10


def bytes_of(text):
    number, unit = text.split()
    return float(number) * UNITS[unit]


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    path = tmp_path_factory.mktemp("memory")
    (path / "textures").mkdir()
    (path / "lights.json").write_text(LIGHTS)
    for line in MAKE:
        code, error = run(path, line)
        assert code == 0, error
    return path


@pytest.mark.parametrize("name", RUNS)
def test_too_little_memory_is_refused_before_the_work(folder, name):
    line, smaller, little = RUNS[name]
    (folder / "out.glint").unlink(missing_ok=True)
    (folder / "out.exr").unlink(missing_ok=True)
    code, error = run(folder, line, "--max-memory", little)
    assert code == 4, error
    assert "--max-memory" in error and not {"out.glint", "out.exr"} & set(os.listdir(folder))
    # The message says how much; the run then has enough, and takes no more.
    said = re.search(r"(?:take|needs) ([\d.]+ (?:bytes|[KMGT]B)) of memory", error)
    assert said, error
    need = bytes_of(said[1])
    taken = peak(folder, line, "--max-memory", said[1].replace(" bytes", "").replace(" ", ""))
    least_base, base = WITH_IMAGES if name in IMAGES else PLAIN
    mapped = sum((folder / word).stat().st_size for word in line.split() if word.endswith(".glint") and word != "out.glint")
    assert taken <= need + base + mapped, f"takes {taken / MB:.0f} MB, said {said[1]}, of files {mapped / MB:.0f} MB"
    assert need <= MOST_EXCESS * max(taken - least_base, SMALL), f"takes {taken / MB:.0f} MB, said {said[1]}"
    if smaller is not None:
        code, error = run(folder, smaller, "--force", "--max-memory", str(int(max(need / 2, MB))))
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


BMP = b"BM" + struct.pack("<IHHI", 120, 0, 0, 54) + struct.pack("<IiiHHIIiiII", 40, 17000, 17000, 1, 24, 0, 0, 0, 0, 0, 0)
RUN_LENGTHS = 10  # type of a TGA
TGA = struct.pack("<BBBHHBHHHHBB", 0, 0, RUN_LENGTHS, 0, 0, 0, 0, 0, 17800, 17800, 24, 0)


@pytest.mark.parametrize(
    "header, name",
    [
        (b"PF\n16000 16000\n-1.0\n", "a.pfm"),
        (b"P6\n30000 30000\n255\n", "a.ppm"),
        (b"Pf\n30000 9000\n-1.0\n", "b.pfm"),
        (BMP, "a.bmp"),
        (TGA, "a.tga"),
    ],
    ids=["rgb.pfm", "ppm", "grey.pfm", "bmp", "tga"],
)
def test_images_that_declare_more_than_they_hold_are_refused(folder, header, name):
    (folder / name).write_bytes(header.ljust(120, b"\0"))
    (folder / "out.glint").unlink(missing_ok=True)
    monitor = subprocess.run(
        ["bash", "-c", f"ulimit -v 2000000; {BIN}/glint-ingest {name} -o out.glint --threads 1"],
        cwd=folder,
        capture_output=True,
        text=True,
        timeout=60,
    )
    assert monitor.returncode == 3, monitor.stderr
    assert "declares more pixels than the file can hold" in monitor.stderr
    assert not (folder / "out.glint").exists()


def test_less_memory_than_any_image_takes_is_refused(folder):
    code, error = run(folder, "ingest large.exr -o out2.glint", "--max-memory", "1M")
    assert code == 4 and "--max-memory" in error
    assert not (folder / "out2.glint").exists()


@pytest.mark.parametrize(
    "image, flags",
    [("large.exr", ""), ("large.png", ""), ("heights.exr", "--kind height"), ("heights.exr", "--kind height --to heights")],
)
def test_images_larger_than_the_memory_give_the_same_asset(folder, image, flags):
    """Pixels, normals and bounds of the first take 100 MB."""
    if image == "large.png":
        assert run(folder, "synth flakes --size 2048 -o large.png --force")[0] == 0
    for name, more in (("fits.glint", []), ("filed.glint", ["--max-memory", "16M"])):
        code, error = run(folder, f"ingest {image} -o {name} --force {flags}", *more)
        assert code == 0, error
    assert (folder / "fits.glint").read_bytes() == (folder / "filed.glint").read_bytes()
    assert not [name for name in os.listdir(folder) if name.startswith(".glint")], "temporary files are gone"


def test_ingest_keeps_to_the_limit(folder):
    """Arrays of 400 MB are moved into files, and do not stay in memory. Before their pages are given up, more come, on a busy machine."""
    most_between = 250 * MB
    assert run(folder, "synth flakes --size 4096 -o huge.exr")[0] == 0
    bound = peak(folder, "ingest huge.exr -o bound.glint", "--max-memory", "16M")
    free = peak(folder, "ingest huge.exr -o bound.glint --force", "--max-memory", "4G")
    assert (
        bound < 16 * MB + WITH_IMAGES[1] + most_between < free
    ), f"takes {bound / MB:.0f} MB, and {free / MB:.0f} MB without a limit"
    for name in ("huge.exr", "bound.glint"):
        (folder / name).unlink()


TABLES = [
    ("binmap", "--alpha .02"),
    ("binmap", "--alpha .005:.1 --leaf-size 4"),
    ("sat", "--bins 9x32 --stride 8"),
    ("sat", "--bins 40x50 --stride 32"),
]


@pytest.mark.parametrize("tool, flags", TABLES)
def test_tables_larger_than_the_memory_are_the_same_asset(folder, tool, flags):
    source = "large.glint" if tool == "binmap" else "middle.glint"
    for name, more in (("fits.glint", []), ("filed.glint", ["--max-memory", "33M"])):
        code, error = run(folder, f"{tool} {source} -o {name} --force {flags}", *more)
        assert code == 0, error
    assert (folder / "fits.glint").read_bytes() == (folder / "filed.glint").read_bytes()
    assert not [name for name in os.listdir(folder) if name.startswith(".glint")], "temporary files are gone"
    code, error = run(folder, f"{tool} {source} -o less.glint {flags}", "--max-memory", "2M")
    assert code == 4 and "--max-memory" in error and not (folder / "less.glint").exists()


@pytest.mark.parametrize("tool, flags", [("binmap", "--alpha .02"), ("sat", "--bins 9x32 --stride 4")])
def test_tables_leave_the_memory(folder, tool, flags):
    """More is in files than stays, though a busy machine gives pages up late."""
    most = 0.85
    bound = peak(folder, f"{tool} large.glint -o bound.glint {flags}", "--max-memory", "33M")
    free = peak(folder, f"{tool} large.glint -o bound.glint --force {flags}", "--max-memory", "4G")
    assert bound < most * free, f"takes {bound / MB:.0f} MB, and {free / MB:.0f} MB without a limit"


def test_bin_maps_for_a_range_need_no_more_than_their_bins(folder):
    code, error = run(folder, "binmap small.glint -o range.glint --alpha .0005:.032", "--max-memory", "64M")
    assert code == 0, error


def test_programs_that_the_bench_starts_keep_the_limit(folder):
    code, error = run(folder, "bench small.glint -o results.json --quick --only pyramid", "--max-memory", "100K")
    results = (folder / "results.json").read_text()
    assert "and 100 KB may be used" in results, error
