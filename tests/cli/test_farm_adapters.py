"""pipelines/farm: a manifest in shards, by Make."""

import json
import pathlib
import subprocess

from conftest import BIN

ROOT = pathlib.Path(__file__).parents[2]


def test_shards_by_make_are_the_whole(glint):
    (glint.folder / "maps").mkdir()
    for seed in range(3):
        subprocess.run(
            [BIN / "glint-synth", "flakes", "--size", "32", "--seed", str(seed), "-o", glint.folder / f"maps/{seed}.png"],
            check=True,
        )
    assert glint("farm", "plan", "maps", "-o", "farm.json", "--make", "sat").returncode == 0
    make = ["make", "-f", ROOT / "pipelines/farm/shards.mk", "-j2", "SHARDS=2", f"GLINT_BIN={BIN}"]
    process = subprocess.run([*make, "MANIFEST=farm.json"], cwd=glint.folder, capture_output=True, text=True)
    assert process.returncode == 0, process.stderr
    status = json.loads(glint("farm", "status", "farm.json", "--json").stdout)["result"]
    assert (status["done"], status["entries"]) == (6, 6)
    process = subprocess.run(make, cwd=glint.folder, capture_output=True, text=True)
    assert process.returncode != 0 and "make MANIFEST=farm.json" in process.stderr


def test_a_map_in_shards_by_slurm_is_the_whole(glint):
    """The tasks of an array, as Slurm starts them: with its variables and the programs on the path."""
    for command in (
        "synth flakes --size 64 -o flakes.png",
        "ingest flakes.png -o flakes.glint",
        "pyramid flakes.glint -o whole.glint --resolution 64 --sigma-r 0.02",
    ):
        assert glint(*command.split()).returncode == 0
    for task in (2, 1, 3):
        environment = {"PATH": f"{BIN}:/usr/bin:/bin", "SLURM_ARRAY_TASK_ID": str(task), "SLURM_ARRAY_TASK_COUNT": "3"}
        script = [ROOT / "pipelines/farm/map-shards.sbatch", "flakes", "--resolution", "64", "--sigma-r", "0.02"]
        process = subprocess.run(["sh", *script], cwd=glint.folder, env=environment, capture_output=True, text=True)
        assert process.returncode == 0, process.stderr
    shards = sorted(path.name for path in glint.folder.glob("flakes.pyramid.*of3.glint"))
    assert glint("merge", *shards, "-o", "flakes.pyramid.glint").returncode == 0
    assert (glint.folder / "flakes.pyramid.glint").read_bytes() == (glint.folder / "whole.glint").read_bytes()
