"""Every tool has the same flags, messages and exit codes."""

import json
import pathlib
import shlex
import subprocess

import pytest
from conftest import BIN

APPS = pathlib.Path(__file__).parents[2] / "apps"
TOOLS = sorted(path.parent.name.removeprefix("glint-") for path in APPS.glob("glint-*/main.cpp"))
COMMANDS = [
    *TOOLS,
    "farm plan",
    "farm run",
    "farm status",
    "query light",
    "query plane",
    "query reflectance",
]  # programs, and their commands
SHARED = [
    "--threads",
    "--max-memory",
    "--trust",
    "--seed",
    "--json",
    "--progress",
    "--quiet",
    "--force",
    "--skip-unchanged",
    "--depfile",
    "--config",
    "--version",
    "--help",
]


def test_there_are_tools():
    assert {"ingest", "synth"} <= set(TOOLS)


@pytest.fixture
def run(glint):
    """Runs a program or a command: run("query light", ...)."""
    return lambda tool, *arguments: glint(*tool.split(), *arguments)


@pytest.mark.parametrize("tool", COMMANDS)
def test_help_lists_shared_flags_and_an_example(run, tool):
    process = run(tool, "--help")
    assert process.returncode == 0
    assert process.stderr == ""
    for flag in SHARED:
        assert flag in process.stdout
    assert f"Example:\n  glint-{tool} " in process.stdout


def test_help_says_in_words_what_an_option_takes(glint):
    text = glint("query", "--help").stdout
    assert "--uv FLOAT FLOAT (not with --csv)" in text
    assert "--sigma FLOAT (1e-06 to 1e+09, not with --box, --cov)" in text  # it has no default that could be meant
    assert "--sigma-r FLOAT (0.0001 to 0.25, default 0.005)" in text
    assert "--depfile FILE " in text
    assert text.index("--uv") < text.index("--threads"), "the tool's own options come first"


@pytest.mark.parametrize("tool", COMMANDS)
def test_version_names_the_tool(run, tool):
    process = run(tool, "--version")
    assert process.returncode == 0
    assert process.stdout.startswith(f"glint-{tool} ")


@pytest.mark.parametrize("tool", COMMANDS)
def test_unknown_option_is_a_usage_error_with_a_suggestion(run, tool):
    process = run(tool, "--thread", "2")
    assert process.returncode == 1
    assert process.stdout == ""
    assert process.stderr.startswith(f"glint-{tool}: error: unknown option --thread; did you mean --threads?")


@pytest.mark.parametrize("tool", COMMANDS)
def test_usage_error_is_json_too(run, tool):
    process = run(tool, "--nonsense-option", "--json")
    assert process.returncode == 1
    assert json.loads(process.stdout)["error"]["code"] == "usage"


def test_full_disk_of_stdout_is_an_error(glint):
    with open("/dev/full", "w") as full:
        command = [BIN / "glint-synth", "flat", "--size", "4", "-o", "a.exr", "--json"]
        process = subprocess.run(command, cwd=glint.folder, stdout=full, stderr=subprocess.PIPE, text=True)
    assert process.returncode == 2
    assert "stdout" in process.stderr


def test_depfile_is_read_by_make(glint):
    name = "in put#1$.png"
    glint("synth", "flakes", "--size", "16", "-o", name)
    output = "out.glint"
    assert glint("ingest", name, "-o", output, "--depfile", "out.d").returncode == 0
    makefile = glint.folder / "Makefile"
    makefile.write_text(f"include out.d\n{output}:\n\t@echo made\n")
    make = ["make", "-s", output]
    assert subprocess.run(make, cwd=glint.folder, capture_output=True, text=True).stdout == ""
    subprocess.run(["touch", "-d", "1 minute", name], cwd=glint.folder, check=True)
    assert subprocess.run(make, cwd=glint.folder, capture_output=True, text=True).stdout == "made\n"
    (glint.folder / name).unlink()  # a deleted input is remade, not a missing rule
    assert subprocess.run(make, cwd=glint.folder, capture_output=True, text=True).returncode == 0


def test_depfile_without_an_output_is_a_usage_error(glint):
    glint("synth", "flakes", "--size", "16", "-o", "flakes.png")
    glint("ingest", "flakes.png", "-o", "flakes.glint")
    process = glint("info", "flakes.glint", "--depfile", "out.d")
    assert process.returncode == 1
    assert "--depfile" in process.stderr
    assert not (glint.folder / "out.d").exists()
    process = glint("synth", "flat", "--size", "4", "-o", "a.png", "--depfile", "")
    assert process.returncode == 1
    assert "empty" in process.stderr


def test_configuration_may_begin_with_a_byte_order_mark(glint):
    (glint.folder / "run.toml").write_bytes(b"\xef\xbb\xbfsize = 8\n")
    assert glint("synth", "flat", "-o", "a.png", "--config", "run.toml").returncode == 0
    assert glint("synth", "flat", "-o", "b.png", "--size", "8").returncode == 0
    assert (glint.folder / "a.png").read_bytes() == (glint.folder / "b.png").read_bytes()


def test_large_numbers_are_told_the_range_of_their_option(glint):
    for option, range_text in (("--threads", "0 to 1024"), ("--order", "0 to 1000")):
        tool = ["shlobes", "--sigma-r", "0.1", "-o", "a.glint"] if option == "--order" else ["synth", "flat", "-o", "a.png"]
        process = glint(*tool, option, "99999999999")
        assert process.returncode == 1
        assert range_text in process.stderr and "2147483647" not in process.stderr, process.stderr


def test_numbers_may_begin_with_a_point(glint):
    glint("synth", "flakes", "--size", "16", "-o", "flakes.png")
    glint("ingest", "flakes.png", "-o", "flakes.glint")
    long = glint("query", "flakes.glint", "--uv", "-0.3", "0.7", "--sigma", "2", "--half", "0.1", "-0.05")
    short = glint("query", "flakes.glint", "--uv", "-.3", ".7", "--sigma", "2", "--half", ".1", "-.05")
    assert long.returncode == 0
    assert short.stdout == long.stdout


def test_examples_in_help_parse(glint):
    glint("synth", "flakes", "--size", "16", "-o", "flakes.png")
    for tool in ("synth", "ingest"):
        example = glint(tool, "--help").stdout.split("Example:\n  ")[1].splitlines()[0]
        process = glint(tool, *shlex.split(example)[1:])
        assert process.returncode == 0, process.stderr


def test_commands_are_in_the_help_of_their_program(glint):
    text = glint("query", "--help").stdout
    for command in ("light", "plane", "reflectance"):
        assert f"glint-query {command} ASSET" in text


def test_shared_flags_work_behind_a_command(glint):
    """--config, --json, --threads, --seed, --depfile and --progress of `glint-query reflectance`, and its example."""
    glint("synth", "isotropic", "--size", "64", "--height", "-o", "h.exr")
    assert glint("ingest", "h.exr", "--kind", "height", "--to", "heights", "-o", "h.glint").returncode == 0
    assert glint("displace", "h.glint", "-o", "rock.displaced.glint", "--factors", "4,8", "--quiet").returncode == 0
    command = ["query", "reflectance"]
    example = shlex.split(glint(*command, "--help").stdout.split("Example:\n  ")[1].splitlines()[0])
    process = glint(*command, *example[2:], "--threads", "1", "--progress", "none", "--json")
    assert process.returncode == 0, process.stderr
    document = json.loads(process.stdout)
    assert document["tool"] == "glint-query reflectance" and document["result"]["reflected"]
    (glint.folder / "ask.toml").write_text("uv = [0.3, 0.7]\nsigma = 8\nwi = [0.5, 0, 1]\nwo = [-0.2, 0.1, 1]\n")
    asked = glint(*command, "rock.displaced.glint", "--config", "ask.toml", "--json")
    assert json.loads(asked.stdout)["result"] == document["result"]
    sampled = [
        "rock.displaced.glint",
        "--uv",
        "0.3",
        "0.7",
        "--level",
        "0",
        "--wo",
        "0",
        "0",
        "1",
        "--samples",
        "4",
        "-o",
        "s.csv",
    ]
    assert glint(*command, *sampled, "--seed", "3", "--depfile", "s.d").returncode == 0
    first = (glint.folder / "s.csv").read_text()
    assert (glint.folder / "s.d").read_text().startswith("s.csv:") and "rock.displaced.glint" in (
        glint.folder / "s.d"
    ).read_text()
    assert glint(*command, *sampled, "--seed", "4").returncode == 0
    assert (glint.folder / "s.csv").read_text() != first
