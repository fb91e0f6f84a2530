"""Every call of the system fails once, in every program: exit code and blame are right, and outputs are whole or not there.

GLINT_FAULTS=all walks over every call; otherwise over some of each class, other ones for each tool.
GLINT_FAULTS_PART=1/2 takes the second half of the programs: two processes share the time."""

import errno
import os
import pathlib
import shutil
import signal
import subprocess
import time

import pytest
from fault_runner import FaultRunner, contents

BIN = pathlib.Path(os.environ["GLINT_BIN_DIR"]).resolve()
LIBRARY = pathlib.Path(os.environ["GLINT_FAULT_LIBRARY"]).resolve()
OPENER = pathlib.Path(os.environ["GLINT_FAULT_OPENER"]).resolve()
ALL = os.environ.get("GLINT_FAULTS") == "all"
PART, PARTS = (int(word) for word in os.environ.get("GLINT_FAULTS_PART", "0/1").split("/"))
# Calls of a class that fail in each program, unless all do: as many as SECONDS allow.
LEAST, MOST_SAMPLED, SECONDS = 3, 12, 0.6
MOST = 1000  # of all: some programs take memory more often

LONGEST_ERROR = 2000  # bytes, as in test_outputs.py
MEMORY, INPUT_OUTPUT = 4, 2  # exit codes
NO_MEMORY = ["out of memory", "Cannot allocate memory"]

# class of calls: error, exit codes and reasons of which the message has one
FAULTS = {
    "memory": [(errno.ENOMEM, [MEMORY], NO_MEMORY)],
    "open": [(errno.EMFILE, [INPUT_OUTPUT], ["Too many open files"]), (errno.EIO, [INPUT_OUTPUT], ["Input/output error"])],
    "read": [(errno.EIO, [INPUT_OUTPUT], ["Input/output error"])],
    "write": [(errno.ENOSPC, [INPUT_OUTPUT], ["No space left on device"]), (errno.EFBIG, [INPUT_OUTPUT], ["File too large"])],
    "reserve": [(errno.ENOSPC, [INPUT_OUTPUT], ["No space left on device"])],
    "fsync": [(errno.EIO, [INPUT_OUTPUT], ["Input/output error"])],
    "rename": [(errno.EACCES, [INPUT_OUTPUT], ["Permission denied"])],
    "mmap": [(errno.ENOMEM, [INPUT_OUTPUT, MEMORY], NO_MEMORY)],
    "close": [(errno.EIO, [INPUT_OUTPUT], ["Input/output error"])],
}

LIGHTS = '{"lights": [{"type": "sphere", "centre": [0, 0, 5], "radius": 1, "radiance": [1, 1, 1]}]}'
MAKE = [
    "synth isotropic --size 32 -o map.exr",
    "synth isotropic --size 32 -o map.png",
    "ingest map.exr -o normals.glint",
    "synth isotropic --height --size 32 -o heights.exr",
    "ingest heights.exr --kind height --to heights -o heights.glint",
    "pyramid normals.glint -o pyramid.glint --stride 16 --resolution 32 --sigma-r 0.1",
    "displace heights.glint -o displaced.glint --factor 16 --base diffuse:0.8",
]
# name: command line, its outputs. Of the programs with images some load OpenImageIO.
TOOLS = {
    "synth": ("synth isotropic --size 8 -o out.exr", ["out.exr"]),
    "synth-png": ("synth isotropic --size 8 -o out.png", ["out.png"]),
    "ingest": ("ingest map.exr -o out.glint --depfile out.d", ["out.glint", "out.d"]),
    "ingest-png": ("ingest map.png -o out.glint --json", ["out.glint"]),
    "pyramid": ("pyramid normals.glint -o out.glint --stride 16 --resolution 32 --sigma-r 0.1", ["out.glint"]),
    "compress": ("compress pyramid.glint -o out.glint --rank 2", ["out.glint"]),
    "binmap": ("binmap normals.glint -o out.glint --alpha 0.05", ["out.glint"]),
    "sat": ("sat normals.glint -o out.glint", ["out.glint"]),
    "moments": ("moments normals.glint -o out.glint", ["out.glint"]),
    "tiny": ("tiny normals.glint -o out.glint --cut 16", ["out.glint"]),
    "wang": ("wang normals.glint -o out.glint --size 16", ["out.glint"]),
    "displace": ("displace heights.glint -o out.glint --factor 16 --base diffuse:0.8", ["out.glint"]),
    "shlobes": ("shlobes --sigma-r 0.1 -o out.glint --order 4", ["out.glint"]),
    "shlobes-light": ("shlobes --light lights.json -o out.glint --order 2", ["out.glint"]),
    "query": ("query normals.glint --uv .5 .5 --sigma 4 --half .1 .05", []),
    "query-image": ("query normals.glint --uv .5 .5 --sigma 4 --image out.exr --image-size 16", ["out.exr"]),
    "query-table": ("query normals.glint --csv questions.csv -o out.csv", ["out.csv"]),
    "info": ("info normals.glint", []),
    "validate": ("validate normals.glint", []),
}


def command_of(line):
    words = line.split()
    return [BIN / f"glint-{words[0]}", *words[1:], "--threads", "1"]


@pytest.fixture(scope="module")
def inputs(tmp_path_factory):
    folder = tmp_path_factory.mktemp("inputs")
    (folder / "lights.json").write_text(LIGHTS)
    (folder / "questions.csv").write_text("u,v,sigma,hx,hy\n.5,.5,4,.1,.1\n")
    for line in MAKE:
        subprocess.run(command_of(line), cwd=folder, check=True, timeout=120)
    return folder


def chosen(count, most, seed):
    """Numbers of calls that fail: all, or a few that are spread evenly, other ones for each seed."""
    if count <= most:
        return list(range(1, count + 1))
    step = count / most
    return sorted({1 + int(k * step + seed * 0.618 * step % step) for k in range(most)})


class Walk:
    """A command, its good results, and the checks of a run in which a call failed."""

    def __init__(self, runner, folder, outputs):
        self.runner, self.folder, self.outputs = runner, folder, outputs
        self.before = contents(folder)
        begin = time.monotonic()
        self.good = runner.run()
        seconds = time.monotonic() - begin
        self.most = MOST if ALL else max(LEAST, min(MOST_SAMPLED, int(SECONDS / seconds)))
        assert self.good.status == 0, self.good.stderr
        self.results = {name: (folder / name).read_bytes() for name in outputs}
        assert set(contents(folder)) == set(self.before) | set(outputs)

    def reset(self, old):
        """Puts outputs of an earlier run there, or none, and takes away all else."""
        for leftover in set(contents(self.folder)) - set(self.before) - set(self.outputs):
            (self.folder / leftover).unlink()
        for name in self.outputs:
            if old:
                (self.folder / name).write_bytes(self.results[name])
            else:
                (self.folder / name).unlink(missing_ok=True)

    def check(self, outcome, codes, reasons):
        after = contents(self.folder)
        left = set(after) - set(self.before) - set(self.outputs)
        assert not left, f"status {outcome.status}, leaves {sorted(left)}: {outcome.stderr}"
        for name in self.outputs:
            assert after.get(name, self.results[name]) == self.results[name], f"{name} is whole, or not there"
        if outcome.status == 0:
            lost = outcome.stdout != self.good.stdout or not all(name in after for name in self.outputs)
            assert not lost, "nothing is lost"
            return
        message = outcome.stderr or outcome.stdout  # the findings of glint-validate are its result
        status = outcome.status
        assert status in codes, f"status {status}: {message}"
        assert any(reason in message for reason in reasons), message
        assert message.count("\n") == 1 and len(message) <= LONGEST_ERROR, message
        assert not any(word in message for word in ("damaged", "truncated", "defect", "internal")), message

    def failures(self, kind, seed=0):
        """Lets calls of a class fail, each in a run of its own. Returns how many runs failed, and what was wrong."""
        failed, wrong = 0, []
        numbers = chosen(self.good.counts[kind], self.most, seed)
        for k, (error, codes, reasons) in enumerate(FAULTS[kind]):
            for number in numbers[k :: len(FAULTS[kind])]:
                self.reset(old=number % 2 == 0)
                outcome = self.runner.run(kind, number, error)
                failed += outcome.status != 0
                try:
                    self.check(outcome, codes, reasons)
                except AssertionError as failure:
                    wrong.append(f"{kind} {number}, {errno.errorcode[error]}: {str(failure).splitlines()[0][:400]}")
        self.reset(old=False)
        return failed, wrong


# Classes of which each program makes calls, and those of which at least one call is needed for its result.
READS = {"memory", "open", "mmap", "close"}
WRITES = READS | {"write", "fsync", "rename"}
NEEDED = {"memory", "write", "fsync", "rename"}


def check_walk(walk, kind, expected, seed=0):
    count = walk.good.counts[kind]
    if count == 0:
        assert kind not in expected, f"calls of the class {kind} are not seen"
        pytest.skip("makes no such call")
    failed, wrong = walk.failures(kind, seed)
    assert not wrong, f"{len(wrong)} of {count}:\n" + "\n".join(wrong[:20])
    assert failed > 0 or kind not in NEEDED, "no run failed"


@pytest.fixture(scope="module")
def walk(request, inputs, tmp_path_factory):
    """One program, which serves all tests of it."""
    line, outputs = TOOLS[request.param]
    folder = tmp_path_factory.mktemp(request.param)
    shutil.copytree(inputs, folder, dirs_exist_ok=True)
    with FaultRunner(LIBRARY, command_of(line), folder) as runner:
        yield Walk(runner, folder, outputs)


@pytest.mark.parametrize("walk, name", [(name, name) for name in list(TOOLS)[PART::PARTS]], indirect=["walk"], scope="module")
@pytest.mark.parametrize("kind", FAULTS)
def test_every_call_may_fail(walk, name, kind):
    if (name, kind) == ("shlobes-light", "memory"):
        pytest.skip("libsharp, which is linked in, does not check what it allocates")
    check_walk(walk, kind, WRITES if walk.outputs else READS, list(TOOLS).index(name))


@pytest.mark.skipif(PART > 0, reason="in the first part")
@pytest.mark.parametrize("asset", ["normals.glint", "pyramid.glint"])
def test_opening_in_a_program_of_others_may_fail(inputs, tmp_path, asset):
    """glint_ndf_open returns the error: it does not end the program, and does not call the file damaged."""
    shutil.copytree(inputs, tmp_path, dirs_exist_ok=True)
    with FaultRunner(LIBRARY, [OPENER, asset], tmp_path) as runner:
        walk = Walk(runner, tmp_path, [])
        walk.most = MOST
        for kind in sorted(READS):
            check_walk(walk, kind, READS)
