"""What the tests of integrations share."""

import os
import pathlib
import shutil
import subprocess

import pytest

ROOT = pathlib.Path(__file__).resolve().parents[3]
BIN = pathlib.Path(os.environ.get("GLINT_BIN_DIR", ROOT / "build" / "bin")).resolve()
PIPELINES = ROOT / "pipelines"


def run(folder, *commands):
    """Runs command lines without "glint-" in a folder; each must succeed."""
    for command in commands:
        name, *arguments = command.split()
        process = subprocess.run([BIN / f"glint-{name}", *arguments], cwd=folder, capture_output=True, text=True, timeout=120)
        assert process.returncode == 0, process.stderr


@pytest.fixture(scope="session")
def car_paint(tmp_path_factory):
    """A folder with the documents of the example and the asset that they name, made as they say, but smaller."""
    folder = tmp_path_factory.mktemp("car_paint")
    run(folder, "synth flake2d -o flakes.png --size 128 --flake-size-uv .05 --roughness 0.35 --coverage 1", "ingest flakes.png -o flakes.glint",
        "pyramid flakes.glint -o flakes.pyramid.glint --resolution 64 --stride 32")
    for document in (*(PIPELINES / "materialx").glob("*.mtlx"), *(PIPELINES / "usd").glob("*.usda")):
        shutil.copy(document, folder)
    return folder
