"""The tutorial works as it is printed: its commands run in turn, in one shell and an empty folder, and its programs are built against an
installed package."""

import os
import pathlib
import re
import subprocess

import pytest
from conftest import BIN
from test_installed import BUILD, cache, instrumented
from test_readme import blocks, same, session_of

ROOT = pathlib.Path(__file__).parents[2]
TUTORIAL = (ROOT / "docs/TUTORIAL.md").read_text()
END_OF_OUTPUT = "\x1e"

pytestmark = pytest.mark.skipif(instrumented("thread"), reason="programs of others cannot link a library for ThreadSanitizer")


def files():
    """{name: text} of the blocks that follow a file's name."""
    return dict(re.findall(r"^`(app/[\w.]+)`:\n\n```\w+\n(.*?)^```", TUTORIAL, re.MULTILINE | re.DOTALL))


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("tutorial")


@pytest.fixture(scope="module")
def outputs(folder, tmp_path_factory):
    """What each command printed, after all files of the page were written."""
    home = tmp_path_factory.mktemp("glint")
    (home / "build").symlink_to(BUILD)
    for name, text in files().items():
        (folder / name).parent.mkdir(exist_ok=True)
        (folder / name).write_text(text)
    script = "set -e\n" + "".join(f"{command}\nprintf '{END_OF_OUTPUT}'\n" for command, _ in session_of(TUTORIAL))
    environment = {
        **os.environ,
        "GLINT": str(home),
        "PATH": f"{BIN}:{os.environ['PATH']}",
        "CFLAGS": cache("CMAKE_C_FLAGS"),
        "CXXFLAGS": cache("CMAKE_CXX_FLAGS"),
    }
    process = subprocess.run(["bash", "-c", script], cwd=folder, env=environment, capture_output=True, text=True, timeout=240)
    assert process.returncode == 0, f"{process.stdout}\n{process.stderr}"
    return process.stdout.split(END_OF_OUTPUT)[:-1]


def test_commands_print_what_the_page_says(outputs):
    steps = session_of(TUTORIAL)
    assert len(outputs) == len(steps) > 10
    wrong = [f"{command}\n{output}" for (command, expected), output in zip(steps, outputs) if not same(output, expected)]
    assert wrong == []


def test_programs_answer_what_the_shell_does(outputs):
    answers = {command: output for (command, _), output in zip(session_of(TUTORIAL), outputs)}
    shell = [
        float(output) for command, output in answers.items() if command.startswith("glint-query flakes.cp.glint") and output
    ]
    for program in ("ask", "ask_c"):
        numbers = re.findall(
            r"^(?:density|mean over a light) (\S+)$", answers[f"app/build/{program} flakes.cp.glint"], re.MULTILINE
        )
        assert [float(number) for number in numbers] == pytest.approx(shell, rel=1e-5)  # printed with six digits


def test_programs_are_those_that_other_tests_build():
    assert files()["app/main.cpp"] == (ROOT / "tests/consumer/main.cpp").read_text()
    assert files()["app/main.c"] == (ROOT / "tests/consumer_installed/main.c").read_text()


def test_assets_can_be_read_with_h5py_as_the_page_on_the_format_says(folder, outputs):
    (code,) = blocks((ROOT / "docs/FORMAT.md").read_text(), "python")
    process = subprocess.run(["/usr/bin/python3", "-c", code], cwd=folder, capture_output=True, text=True)
    assert process.returncode == 0, process.stderr
    blocks_of_image, block, mean = re.search(r"(\d+) blocks; first at block (\d+) with mean (\S+)", process.stdout).groups()
    assert 0 < int(blocks_of_image) <= 256 and int(block) < 256 and float(mean) > 0
