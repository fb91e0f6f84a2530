"""glint-ingest keeps to --max-memory: an image of 16384 x 16384 half floats in less than 1 GB. Slow, and takes 10 GB of disk."""

import os
import resource
import struct
import subprocess

import numpy
import pytest
from conftest import BIN

GB = 1 << 30
LARGE = 16384  # texels along either axis
LIMIT = 500 << 20  # bytes, of --max-memory; the program and its libraries come to it
ROOM = 14 * GB  # on the disk: the image, arrays that do not fit, the asset


def attribute(name, kind, value):
    return name + b"\0" + kind + b"\0" + struct.pack("<i", len(value)) + value


def write_exr(path, size):
    """Normals of waves in red and green, as half floats without compression, row by row."""
    channels = b"".join(name + b"\0" + struct.pack("<iiii", 1, 0, 1, 1) for name in (b"G", b"R")) + b"\0"
    window = struct.pack("<iiii", 0, 0, size - 1, size - 1)
    header = struct.pack("<ii", 20000630, 2)
    header += attribute(b"channels", b"chlist", channels) + attribute(b"compression", b"compression", b"\0")
    header += attribute(b"dataWindow", b"box2i", window) + attribute(b"displayWindow", b"box2i", window)
    header += attribute(b"lineOrder", b"lineOrder", b"\0") + attribute(b"pixelAspectRatio", b"float", struct.pack("<f", 1))
    header += (
        attribute(b"screenWindowCenter", b"v2f", struct.pack("<ff", 0, 0))
        + attribute(b"screenWindowWidth", b"float", struct.pack("<f", 1))
        + b"\0"
    )
    row_bytes = 2 * 2 * size
    first = len(header) + 8 * size
    x = numpy.arange(size)
    with open(path, "wb") as file:
        file.write(header + struct.pack(f"<{size}Q", *(first + y * (8 + row_bytes) for y in range(size))))
        for y in range(size):
            red = (0.5 + 0.15 * numpy.sin(x * 0.37 + y * 0.011)).astype("<f2")
            green = (0.5 + 0.15 * numpy.cos(x * 0.013 + y * 0.23)).astype("<f2")
            file.write(struct.pack("<ii", y, row_bytes) + green.tobytes() + red.tobytes())


def ingest(folder, *flags, data_limit=None):
    """Runs the program. Returns its peak of memory, mapped files included, and its processor time in seconds."""
    limit = (lambda: resource.setrlimit(resource.RLIMIT_DATA, (data_limit, data_limit))) if data_limit else None
    process = subprocess.Popen(
        [BIN / "glint-ingest", *flags, "--threads", "2"], cwd=folder, stderr=subprocess.PIPE, preexec_fn=limit
    )
    error = process.stderr.read().decode()
    _, status, usage = os.wait4(process.pid, 0)
    process.returncode = os.waitstatus_to_exitcode(status)
    assert process.returncode == 0, error
    return usage.ru_maxrss << 10, usage.ru_utime + usage.ru_stime


def test_an_image_that_does_not_fit_is_ingested(tmp_path):
    if os.statvfs(tmp_path).f_bavail * os.statvfs(tmp_path).f_frsize < ROOM:
        pytest.skip("there is no room on the disk for the image and its asset")
    write_exr(tmp_path / "large.exr", LARGE)
    peak, seconds = ingest(tmp_path, "large.exr", "-o", "large.glint", "--max-memory", str(LIMIT), data_limit=GB)
    print(f"ingest of {LARGE}x{LARGE}: peak {peak / GB:.2f} GB, {seconds:.0f} s of the processor")
    assert peak < GB
    assert (tmp_path / "large.glint").stat().st_size > 13 * LARGE * LARGE, "normals of 8 bytes and bounds of 5.3"
    validated = subprocess.run([BIN / "glint-info", "large.glint"], cwd=tmp_path, capture_output=True, text=True)
    assert validated.returncode == 0 and str(LARGE) in validated.stdout
    # So that a folder of temporary files is not filled.
    for name in ("large.exr", "large.glint"):
        (tmp_path / name).unlink()
