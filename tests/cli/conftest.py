"""What the command-line tests share."""

import os
import pathlib
import subprocess

import pytest

BIN = pathlib.Path(os.environ.get("GLINT_BIN_DIR", pathlib.Path(__file__).parents[2] / "build" / "bin")).resolve()


@pytest.fixture
def glint(tmp_path):
    """Runs glint-NAME in an empty folder; returns the finished process."""

    def run(name, *arguments):
        command = [str(BIN / f"glint-{name}"), *map(str, arguments)]
        return subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, errors="surrogateescape", timeout=120)

    run.folder = tmp_path
    run.bin = BIN
    return run


def run_all(glint, *commands):
    """Runs command lines without "glint-", each of which must succeed."""
    for command in commands:
        process = glint(*command.split())
        assert process.returncode == 0, process.stderr
