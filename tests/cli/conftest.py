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


_MADE = {}  # commands -> {name: bytes} of the files that they have made


def run_once(glint, *commands):
    """Makes the files of command lines. Of several tests that ask the same, the first runs them, and the others get copies."""
    if commands not in _MADE:
        before = set(glint.folder.iterdir())
        run_all(glint, *commands)
        _MADE[commands] = {path.name: path.read_bytes() for path in set(glint.folder.iterdir()) - before}
    for name, data in _MADE[commands].items():
        (glint.folder / name).write_bytes(data)
