"""pipelines/glint.mk: images become assets, and only what changed is made again."""

import os
import pathlib
import shutil
import subprocess

import pytest
from conftest import BIN

ROOT = pathlib.Path(__file__).parents[2]
MAKEFILE = """
GLINT_BIN := {bin}
GLINT_MAPS := maps
GLINT_OUT := assets
GLINT_PYRAMID_FLAGS := --resolution 64 --sigma-r 0.02
GLINT_INGEST_FLAGS_dunes := --kind height
GLINT_DISPLACE_FLAGS := --factors 16,64 --angular 5
all: $(foreach method,cp tucker pca binmap sat,assets/flakes.$(method).glint) assets/dunes.pca.glint assets/dunes.displaced.glint
include {root}/pipelines/glint.mk
"""


@pytest.fixture
def project(tmp_path):
    (tmp_path / "maps").mkdir()
    shutil.copy(ROOT / "data-samples/flakes_256.png", tmp_path / "maps/flakes.png")
    shutil.copy(ROOT / "data-samples/isotropic_height_256.exr", tmp_path / "maps/dunes.exr")
    (tmp_path / "Makefile").write_text(MAKEFILE.format(bin=BIN, root=ROOT))

    def make(*arguments):
        process = subprocess.run(["make", *arguments], cwd=tmp_path, capture_output=True, text=True, timeout=250,
                                 env={key: value for key, value in os.environ.items() if not key.startswith("MAKE")})
        assert process.returncode == 0, process.stdout + process.stderr
        return process.stdout

    make.folder = tmp_path
    return make


def tools(output):
    return sorted(pathlib.Path(line.split()[0]).name for line in output.splitlines() if "glint-" in line)


def later(path):
    """Marks a file as changed, without waiting for the clock."""
    newest = max(p.stat().st_mtime for p in path.parents[1].rglob("*"))
    os.utime(path, (newest + 2, newest + 2))


def test_images_become_assets_and_only_changes_are_made_again(project):
    first = tools(project("-j2"))
    assert first == ["glint-binmap"] + ["glint-compress"] * 4 + ["glint-displace"] + ["glint-ingest"] * 3 + ["glint-pyramid"] * 2 + ["glint-sat"]
    made = {p.name for p in (project.folder / "assets").glob("*.glint")}
    assert made == {f"{n}.glint" for n in ("flakes", "flakes.pyramid", "flakes.cp", "flakes.tucker", "flakes.pca", "flakes.binmap",
                                                 "flakes.sat", "dunes", "dunes.pyramid", "dunes.pca", "dunes.heights", "dunes.displaced")}
    assert subprocess.run([BIN / "glint-validate", *(project.folder / "assets").glob("*.glint")]).returncode == 0

    assert tools(project("-j2")) == []

    later(project.folder / "maps/dunes.exr")
    assert tools(project("-j2")) == ["glint-compress", "glint-displace", "glint-ingest", "glint-ingest", "glint-pyramid"]

    later(project.folder / "Makefile")
    assert tools(project("--dry-run")) == first
