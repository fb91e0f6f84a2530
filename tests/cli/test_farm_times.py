"""What glint-farm takes beside the programs that it starts. Slow: `pytest -s tests/cli/test_farm_times.py` prints the figures.

Times are processor times, so that other programs on the machine count for little.
"""

import json
import resource
import subprocess

from conftest import BIN

MAPS = 10_000
# The promises: docs/TOOLS.md names them.
MOST_PLAN_S = 5
MOST_RERUN_S = 2
MOST_OVERHEAD = 0.03
SIZE = 2048


def cpu_s(function):
    """Processor time of all programs that a function runs."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    function()
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def farm(folder, *arguments):
    process = subprocess.run([BIN / "glint-farm", *arguments], cwd=folder, capture_output=True, text=True)
    assert process.returncode == 0, process.stderr
    return process.stdout


def pretend_made(folder):
    """Makes a tiny file for every entry, and the records of a run that has made it."""
    lines = []
    for entry in json.loads((folder / "farm.json").read_text())["entries"]:
        path = folder / entry["output"]
        path.parent.mkdir(exist_ok=True)
        path.write_bytes(b"x")
        status = path.stat()
        stamp = {"file": entry["output"], "size_bytes": 1, "mtime_ns": status.st_mtime_ns, "inode": status.st_ino}
        lines.append(json.dumps({"key": entry["key"], "output": entry["output"], "status": "made", "files": [stamp]}))
    (folder / "farm.json.log").write_text("\n".join(lines) + "\n")


def test_ten_thousand_maps_are_planned_and_found_quickly(tmp_path):
    (tmp_path / "maps").mkdir()
    for k in range(MAPS):
        (tmp_path / f"maps/map{k}.png").write_text(str(k))
    plan = ["plan", "maps", "-o", "farm.json", "--make", "normals"]
    first_s = cpu_s(lambda: farm(tmp_path, *plan))
    plan_s = cpu_s(lambda: farm(tmp_path, *plan))
    assert json.loads(farm(tmp_path, *plan, "--json"))["result"] == {
        "maps": MAPS,
        "hashed_maps": 0,
        "entries": MAPS,
        "duplicates": 0,
        "done": 0,
    }
    pretend_made(tmp_path)
    rerun_s = cpu_s(lambda: farm(tmp_path, "run", "farm.json"))
    assert json.loads(farm(tmp_path, "run", "farm.json", "--json"))["result"]["known"] == MAPS
    print(
        f"\n{MAPS} maps: plan {plan_s:.2f} s with known hashes ({first_s:.2f} s with tiny files to read), rerun with nothing to do {rerun_s:.2f} s"
    )
    assert plan_s <= MOST_PLAN_S
    assert rerun_s <= MOST_RERUN_S


def test_a_farm_takes_little_beside_the_programs(tmp_path):
    """ingest, pyramid and bin map of a 2K map: what the farm takes itself, and for a look the same commands by hand."""
    (tmp_path / "maps").mkdir()
    subprocess.run(
        [BIN / "glint-synth", "flakes", "--size", str(SIZE), "--bits", "16", "-o", tmp_path / "maps/map.png"], check=True
    )
    farm(tmp_path, "plan", "maps", "-o", "farm.json", "--make", "pyramid", "--make", "binmap")
    together = cpu_s(lambda: farm(tmp_path, "run", "farm.json", "--threads", "1"))
    lines = [json.loads(line) for line in (tmp_path / "farm.json.log").read_text().splitlines()]
    programs = sum(line["cpu_s"] for line in lines)
    commands = [entry["command"] for entry in json.loads((tmp_path / "farm.json").read_text())["entries"]]
    by_hand = cpu_s(
        lambda: [
            subprocess.run([BIN / program, *words, "--threads", "1"], cwd=tmp_path, check=True) for program, *words in commands
        ]
    )
    print(
        f"\n{len(lines)} programs on a map of {SIZE}^2: {programs:.2f} s in a farm, which takes {together - programs:.3f} s beside them "
        f"({together / programs - 1:.1%}); {by_hand:.2f} s by hand"
    )
    assert len(lines) == len(commands) == 3
    assert together - programs <= MOST_OVERHEAD * programs
