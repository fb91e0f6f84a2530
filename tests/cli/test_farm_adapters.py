"""pipelines/farm: a manifest in shards, by Make."""

import json
import pathlib
import subprocess

from conftest import BIN

ROOT = pathlib.Path(__file__).parents[2]


def test_shards_by_make_are_the_whole(glint):
    (glint.folder / "maps").mkdir()
    for seed in range(3):
        subprocess.run([BIN / "glint-synth", "flakes", "--size", "32", "--seed", str(seed), "-o", glint.folder / f"maps/{seed}.png"], check=True)
    assert glint("farm", "plan", "maps", "-o", "farm.json", "--make", "sat").returncode == 0
    make = ["make", "-f", ROOT / "pipelines/farm/shards.mk", "-j2", "SHARDS=2", f"GLINT_BIN={BIN}"]
    process = subprocess.run([*make, "MANIFEST=farm.json"], cwd=glint.folder, capture_output=True, text=True)
    assert process.returncode == 0, process.stderr
    status = json.loads(glint("farm", "status", "farm.json", "--json").stdout)["result"]
    assert (status["done"], status["entries"]) == (6, 6)
    process = subprocess.run(make, cwd=glint.folder, capture_output=True, text=True)
    assert process.returncode != 0 and "make MANIFEST=farm.json" in process.stderr
