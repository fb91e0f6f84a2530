"""Runs a program many times, each time with one call of the system that fails. See faults.c."""

import os
import pathlib
import subprocess
import tempfile
from dataclasses import dataclass

REQUESTS, ANSWERS = 198, 199
STOP = -2  # instead of an error: the signal TERM


@dataclass
class Outcome:
    """The end of one run."""

    status: int  # exit code; negative: the signal that ended it
    counts: dict
    stdout: str
    stderr: str


class FaultRunner:
    """A program that waits to be run. Use as a context."""

    def __init__(self, library, command, folder):
        requests, self._requests = os.pipe()
        self._answers, answers = os.pipe()
        self._texts = [tempfile.TemporaryFile(), tempfile.TemporaryFile()]  # stdout, stderr

        def connect():
            os.dup2(requests, REQUESTS)
            os.dup2(answers, ANSWERS)

        environment = {**os.environ, "LD_PRELOAD": str(library), "TMPDIR": str(folder)}
        self._process = subprocess.Popen(
            [str(word) for word in command],
            cwd=folder,
            env=environment,
            preexec_fn=connect,
            close_fds=False,
            stdin=subprocess.DEVNULL,
            stdout=self._texts[0],
            stderr=self._texts[1],
        )
        os.close(requests)
        os.close(answers)
        self._lines = os.fdopen(self._answers)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        os.close(self._requests)
        self._process.wait(timeout=60)
        self._lines.close()

    def run(self, kind="none", number=0, error=0):
        for text in self._texts:
            os.ftruncate(text.fileno(), 0)
            os.lseek(text.fileno(), 0, os.SEEK_SET)
        os.write(self._requests, f"{kind} {number} {error}\n".encode())
        words = self._lines.readline().split()
        assert words, f"{self._process.args[0]} does not answer"
        status = int(words[0])
        code = os.waitstatus_to_exitcode(status)
        texts = [os.pread(text.fileno(), 1 << 20, 0).decode(errors="replace") for text in self._texts]
        return Outcome(code, {name: int(count) for name, count in (word.split("=") for word in words[1:])}, *texts)


def contents(folder: pathlib.Path):
    """Files of a folder by name."""
    return {path.name: path.read_bytes() for path in folder.iterdir() if path.is_file()}
