"""A pyramid in shards costs little more than one run. Slow."""

import os
import pathlib
import subprocess

import pytest
from conftest import BIN, run_all

MOST_RATIO = 1.15  # processor time of four shards and the merge, to one run: the promise
SHARDS = 4
MOST_SHARE = 0.5  # of the memory of one run that one of four shards may take, beside the program and the map
PROGRAM_BYTES = 40 << 20  # the program, its libraries and what HDF5 holds
MAP_READS = 2  # whole: once for the hash of the record, once for the hashes of the datasets
READS_TOLERANCE = 0.1  # of the map: parts that HDF5 and the configuration of the system are read from


def cost(folder, *arguments):
    """Processor time in seconds, peak of memory in bytes, mapped files included, and bytes that were read by calls of read."""
    process = subprocess.Popen(
        [BIN / f"glint-{arguments[0]}", *arguments[1:], "--threads", "2"], cwd=folder, stderr=subprocess.PIPE
    )
    error = process.stderr.read().decode()
    os.waitid(os.P_PID, process.pid, os.WEXITED | os.WNOWAIT)
    read = int(pathlib.Path(f"/proc/{process.pid}/io").read_text().split()[1])
    _, status, usage = os.wait4(process.pid, 0)
    process.returncode = os.waitstatus_to_exitcode(status)
    assert process.returncode == 0, error
    return usage.ru_utime + usage.ru_stime, usage.ru_maxrss << 10, read


def test_shards_of_a_flat_surface_cost_as_much_as_the_whole(glint):
    run_all(glint, "synth flakes --size 2048 -o map.exr", "ingest map.exr -o map.glint")
    whole, whole_bytes, _ = cost(glint.folder, "pyramid", "map.glint", "-o", "whole.glint")
    shards = [f"map.{i}of{SHARDS}.glint" for i in range(1, SHARDS + 1)]
    parts = [
        cost(glint.folder, "pyramid", "map.glint", "-o", name, "--region", f"{i + 1}/{SHARDS}") for i, name in enumerate(shards)
    ]
    merge, merge_bytes, _ = cost(glint.folder, "merge", *shards, "-o", "joined.glint")
    assert (glint.folder / "joined.glint").read_bytes() == (glint.folder / "whole.glint").read_bytes()
    ratio = (sum(seconds for seconds, _, _ in parts) + merge) / whole
    map_bytes = (glint.folder / "map.glint").stat().st_size
    largest_shard = max((glint.folder / name).stat().st_size for name in shards)
    reads = [read / map_bytes for _, _, read in parts]
    print(
        f"one run {whole:.1f} s and {whole_bytes >> 20} MB; shards {[round(s, 1) for s, _, _ in parts]} s and up to "
        f"{max(b for _, b, _ in parts) >> 20} MB; merge {merge:.1f} s and {merge_bytes >> 20} MB; ratio {ratio:.2f}; map {map_bytes >> 20} MB; "
        f"largest shard {largest_shard >> 20} MB; reads of the map {[round(r, 2) for r in reads]}"
    )
    assert ratio <= MOST_RATIO
    assert max(b for _, b, _ in parts) - map_bytes <= MOST_SHARE * (whole_bytes - map_bytes) + PROGRAM_BYTES
    assert merge_bytes <= largest_shard + PROGRAM_BYTES
    assert reads == pytest.approx([MAP_READS] * SHARDS, abs=READS_TOLERANCE)
    _, _, read = cost(glint.folder, "pyramid", "map.glint", "-o", "trusted.glint", "--region", f"1/{SHARDS}", "--trust")
    assert read / map_bytes == pytest.approx(MAP_READS - 1, abs=READS_TOLERANCE)
