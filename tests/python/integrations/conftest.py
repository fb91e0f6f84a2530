"""What the tests of integrations share."""

import os
import pathlib
import re
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
    """A folder with the documents of the example, and the asset that they name, made as docs/INTEGRATIONS.md says."""
    folder = tmp_path_factory.mktemp("car_paint")
    page = (ROOT / "docs/INTEGRATIONS.md").read_text()
    commands = re.findall(r"^glint-((?:synth flake2d|ingest|pyramid) .*flakes.*)$", page, re.MULTILINE)
    assert [command.split()[0] for command in commands] == ["synth", "ingest", "pyramid"]
    run(folder, *commands)
    for document in (*(PIPELINES / "materialx").glob("*.mtlx"), *(PIPELINES / "usd").glob("*.usda")):
        shutil.copy(document, folder)
    return folder
