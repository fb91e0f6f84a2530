"""Signals, full and closed streams, killed writers, and readers beside a writer: nothing is lost and nothing is left."""

import os
import pathlib
import random
import re
import shutil
import signal
import subprocess
import time

import pytest
from fault_runner import STOP, FaultRunner, contents

BIN = pathlib.Path(os.environ["GLINT_BIN_DIR"]).resolve()
LIBRARY = pathlib.Path(os.environ["GLINT_FAULT_LIBRARY"]).resolve()
RUNS = 3  # that end at moments of chance
SEED = 7


@pytest.fixture(scope="module")
def inputs(tmp_path_factory):
    folder = tmp_path_factory.mktemp("inputs")
    for line in (["glint-synth", "flakes", "--size", "64", "-o", "map.exr"], ["glint-ingest", "map.exr", "-o", "map.glint"]):
        subprocess.run([BIN / line[0], *line[1:]], cwd=folder, check=True, timeout=120)
    return folder


@pytest.fixture
def folder(inputs, tmp_path):
    shutil.copytree(inputs, tmp_path, dirs_exist_ok=True)
    return tmp_path


def writers():
    """Command lines that write each sort of file."""
    return {
        "asset": [
            "glint-pyramid",
            "map.glint",
            "-o",
            "out.glint",
            "--stride",
            "4",
            "--resolution",
            "64",
            "--sigma-r",
            "0.02",
            "--depfile",
            "out.d",
        ],
        "table": ["glint-query", "map.glint", "--uv", ".5", ".5", "--sigma", "4", "--samples", "20000", "-o", "out.csv"],
        "image": ["glint-synth", "isotropic", "--size", "64", "-o", "out.exr"],
    }


def start(folder, words):
    return subprocess.Popen([BIN / words[0], *words[1:]], cwd=folder, stdout=subprocess.PIPE, stderr=subprocess.PIPE)


def run(folder, words, **more):
    return subprocess.run([BIN / words[0], *words[1:]], cwd=folder, capture_output=True, timeout=120, **more)


@pytest.mark.parametrize("name", writers())
def test_a_signal_at_any_call_leaves_nothing(folder, name):
    """Right before each call by which a file is written or gets its name."""
    words = writers()[name]
    before = contents(folder)
    with FaultRunner(LIBRARY, [BIN / words[0], *words[1:], "--threads", "1"], folder) as runner:
        counts = runner.run().counts
        good = contents(folder)
        outputs = set(good) - set(before)
        for kind in ("write", "fsync", "rename"):
            assert counts[kind] > 0
            for number in range(1, counts[kind] + 1):
                for path in outputs:
                    (folder / path).unlink(missing_ok=True)
                outcome = runner.run(kind, number, STOP)
                assert outcome.status == -signal.SIGTERM, f"{kind} {number}: status {outcome.status}"
                after = contents(folder)
                assert set(after) <= set(good), f"{kind} {number}: leaves no temporary file"
                assert all(after[path] == good[path] for path in after), f"{kind} {number}: files are whole"
                assert number > 1 or set(after) == set(before), f"{kind}: no file has its name yet"


@pytest.mark.parametrize("name", writers())
@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT])
def test_a_signal_at_any_moment_leaves_nothing(folder, name, number):
    words = writers()[name]
    before = contents(folder)
    begin = time.monotonic()
    assert run(folder, words).returncode == 0
    seconds = time.monotonic() - begin
    good = contents(folder)
    moments = random.Random(SEED)
    for k in range(RUNS):
        if k % 2 == 0:
            for path in set(good) - set(before):
                (folder / path).unlink(missing_ok=True)
        process = start(folder, words)
        time.sleep(moments.uniform(0, seconds))
        process.send_signal(number)
        process.communicate(timeout=60)
        # Before the handler is there, the system ends the process in the same way; after the work, the signal comes too late.
        assert process.returncode in (-number, 0)
        after = contents(folder)
        assert set(after) <= set(good), "leaves no temporary file"
        assert all(after[path] == good[path] for path in after), "files are whole"


@pytest.mark.parametrize("name", writers())
def test_what_a_killed_writer_left_goes_with_the_next_write(folder, name):
    words = writers()[name]
    begin = time.monotonic()
    assert run(folder, words).returncode == 0
    seconds = time.monotonic() - begin
    good = contents(folder)
    moments = random.Random(SEED)
    for _ in range(RUNS):
        process = start(folder, words)
        time.sleep(moments.uniform(0.3, 1) * seconds)
        process.kill()
        process.communicate(timeout=60)
        after = contents(folder)
        assert all(after[path] == good[path] for path in good if path in after), "files are whole"
    # Leftovers of every sort of file, in case that no run was killed while it had one.
    for path in set(good) - {"map.exr", "map.glint"}:
        (folder / f".{path}.4194304-0-1f.tmp").write_bytes(b"half")
    assert run(folder, words).returncode == 0
    assert contents(folder) == good


def fields_of(process):
    """State and parent of a process; nothing once it has ended."""
    try:
        return pathlib.Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()[:2]
    except OSError:
        return None


def program_of(process):
    try:
        return os.readlink(f"/proc/{process}/exe")
    except OSError:
        return None


def stopped_child(process):
    """Stops a process that this one has started. Returns its number; None if there is none now."""
    for path in pathlib.Path("/proc").glob("[0-9]*"):
        fields = fields_of(path.name)
        if fields is None or fields[1] != str(process) or fields[0] == "Z" or program_of(path.name) == program_of(process):
            continue  # a copy of this process, until it becomes the other program, is waited for
        os.kill(int(path.name), signal.SIGSTOP)
        while (fields := fields_of(path.name)) is not None and fields[0] not in "TZ":
            time.sleep(0.001)
        if fields is not None and fields[0] == "T":
            return int(path.name)
    return None


def test_a_signal_to_the_bench_ends_the_program_that_it_has_started(folder):
    process = start(folder, ["glint-bench", "map.glint", "-o", "results.json"])
    deadline = time.monotonic() + 60
    while (child := stopped_child(process.pid)) is None:
        assert process.poll() is None and time.monotonic() < deadline, "starts no program"
    try:
        process.terminate()
        process.wait(timeout=60)
        assert process.returncode == -signal.SIGTERM
        status = pathlib.Path(f"/proc/{child}/status").read_text()
        pending = int(re.search(r"^ShdPnd:\s*([0-9a-f]+)", status, re.MULTILINE)[1], 16)
        assert pending >> (signal.SIGTERM - 1) & 1, "the program that has been started goes on"
    finally:
        process.kill()
        os.kill(child, signal.SIGCONT)
        process.communicate(timeout=60)


@pytest.mark.parametrize(
    "words",
    [
        ["glint-query", "map.glint", "--uv", ".5", ".5", "--sigma", "4", "--half", "0", "0"],
        ["glint-query", "map.glint", "--csv", "q.csv", "-o", "-"],
        ["glint-info", "map.glint"],
        ["glint-info", "map.glint", "--json"],
        ["glint-validate", "map.glint", "--json"],
        ["glint-validate", "--help"],
        ["glint-validate", "--version"],
    ],
    ids=" ".join,
)
def test_results_that_nobody_gets_are_an_error(folder, words):
    (folder / "q.csv").write_text("u,v,sigma,hx,hy\n.5,.5,4,.1,.1\n")
    command = [BIN / words[0], *words[1:]]
    with open("/dev/full", "w") as full:
        process = subprocess.run(command, cwd=folder, stdout=full, stderr=subprocess.PIPE, timeout=60)
        assert process.returncode == 2 and b"stdout" in process.stderr
        # Without a place for the message the code still says it.
        assert subprocess.run(command, cwd=folder, stdout=full, stderr=full, timeout=60).returncode == 2
    closed = subprocess.run(["bash", "-c", '"$@" >&-', "bash", *command], cwd=folder, capture_output=True, timeout=60)
    assert closed.returncode == 2


@pytest.mark.parametrize("stderr", ["2>/dev/full", "2>&-", "2>/dev/full 0<&-"])
def test_errors_have_their_code_where_the_message_cannot_be_written(folder, stderr):
    for line, code in (
        ("glint-info none.glint", 2),
        ("glint-info map.exr", 3),
        ("glint-info --nonsense", 1),
        ("glint-info map.glint >/dev/null", 0),
    ):
        tool, rest = line.split(" ", 1)
        process = subprocess.run(["bash", "-c", f"{BIN}/{tool} {rest} {stderr}"], cwd=folder, capture_output=True, timeout=60)
        assert process.returncode == code, line
    made = subprocess.run(
        ["bash", "-c", f"{BIN}/glint-sat map.glint -o out.glint --progress json {stderr}"], cwd=folder, timeout=60
    )
    assert made.returncode == 0 and run(folder, ["glint-validate", "out.glint"]).returncode == 0


def test_a_limit_of_the_size_of_files_is_an_error(folder):
    for words in writers().values():
        before = contents(folder)
        process = subprocess.run(
            ["bash", "-c", 'ulimit -f 1; "$@"', "bash", BIN / words[0], *words[1:]], cwd=folder, capture_output=True, timeout=60
        )
        assert process.returncode == 2 and b"File too large" in process.stderr
        assert contents(folder) == before


def test_a_reader_beside_a_writer_sees_whole_files(folder):
    run(folder, ["glint-pyramid", "map.glint", "-o", "a.glint", "--stride", "8", "--resolution", "32", "--sigma-r", "0.1"])
    run(folder, ["glint-pyramid", "map.glint", "-o", "b.glint", "--stride", "16", "--resolution", "32", "--sigma-r", "0.1"])
    shutil.copy(folder / "a.glint", folder / "out.glint")
    stop = time.monotonic() + 1
    readers = []
    while time.monotonic() < stop:
        readers.append(start(folder, ["glint-query", "out.glint", "--uv", ".5", ".5", "--sigma", "30", "--half", "0", "0"]))
        for name in ("a.glint", "b.glint") * 20:
            shutil.copy(folder / name, folder / "next")
            os.replace(folder / "next", folder / "out.glint")
        _, error = readers[-1].communicate(timeout=60)
        assert readers[-1].returncode == 0, error
