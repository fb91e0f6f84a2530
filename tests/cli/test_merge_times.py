"""A pyramid in shards costs little more than one run. Slow."""

import os
import subprocess

from conftest import BIN, run_all

MOST_RATIO = 1.15  # processor time of four shards and the merge, to one run: the promise
SHARDS = 4
MOST_SHARE = 0.5  # of the memory of one run that one of four shards may take, beside the program and the map


def cost(folder, *arguments):
    """Processor time in seconds and peak of memory in bytes, mapped files included."""
    process = subprocess.Popen([BIN / f"glint-{arguments[0]}", *arguments[1:], "--threads", "2"], cwd=folder, stderr=subprocess.PIPE)
    error = process.stderr.read().decode()
    _, status, usage = os.wait4(process.pid, 0)
    process.returncode = os.waitstatus_to_exitcode(status)
    assert process.returncode == 0, error
    return usage.ru_utime + usage.ru_stime, usage.ru_maxrss << 10


def test_shards_of_a_flat_surface_cost_as_much_as_the_whole(glint):
    run_all(glint, "synth flakes --size 2048 -o map.exr", "ingest map.exr -o map.glint")
    whole, whole_bytes = cost(glint.folder, "pyramid", "map.glint", "-o", "whole.glint")
    shards = [f"map.{i}of{SHARDS}.glint" for i in range(1, SHARDS + 1)]
    parts = [cost(glint.folder, "pyramid", "map.glint", "-o", name, "--region", f"{i + 1}/{SHARDS}") for i, name in enumerate(shards)]
    merge, merge_bytes = cost(glint.folder, "merge", *shards, "-o", "joined.glint")
    assert (glint.folder / "joined.glint").read_bytes() == (glint.folder / "whole.glint").read_bytes()
    ratio = (sum(seconds for seconds, _ in parts) + merge) / whole
    map_bytes = (glint.folder / "map.glint").stat().st_size
    print(f"one run {whole:.1f} s and {whole_bytes >> 20} MB; shards {[round(s, 1) for s, _ in parts]} s and up to "
          f"{max(b for _, b in parts) >> 20} MB; merge {merge:.1f} s and {merge_bytes >> 20} MB; ratio {ratio:.2f}; map {map_bytes >> 20} MB")
    assert ratio <= MOST_RATIO
    assert max(b for _, b in parts) - map_bytes <= MOST_SHARE * (whole_bytes - map_bytes) + (40 << 20)
