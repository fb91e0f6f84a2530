"""Runs glint tools as a shell would and measures them as whole processes."""

import dataclasses
import json
import os
import pathlib
import statistics
import subprocess
import sys
import tempfile
import time


@dataclasses.dataclass
class Run:
    """One finished process."""

    wall_s: float
    cpu_s: float
    peak_mb: float
    result: dict

    @staticmethod
    def median(runs):
        """Median of each figure; the result of the last run."""
        middle = lambda name: statistics.median(getattr(run, name) for run in runs)
        return Run(middle("wall_s"), middle("cpu_s"), max(run.peak_mb for run in runs), runs[-1].result)


class Tools:
    """The programs of a build folder."""

    def __init__(self, folder):
        self.folder = pathlib.Path(folder).resolve()
        if not (self.folder / "glint-pyramid").exists():
            sys.exit(f"no programs in {self.folder}; run `make build` first")

    def run(self, tool, *arguments):
        """Runs a tool with --json. A failure ends this script with the tool's own message."""
        command = [str(self.folder / f"glint-{tool}"), *map(str, arguments), "--json", "--quiet"]
        with tempfile.TemporaryFile() as output:
            start = time.perf_counter()
            process = subprocess.Popen(command, stdout=output)
            _, status, usage = os.wait4(process.pid, 0)
            wall = time.perf_counter() - start
            process.returncode = os.waitstatus_to_exitcode(status)
            if process.returncode != 0:
                sys.exit(f"failed with exit code {process.returncode}: {' '.join(command)}")
            output.seek(0)
            text = output.read()
        return Run(wall, usage.ru_utime + usage.ru_stime, usage.ru_maxrss / 1024, json.loads(text)["result"] if text else {})

    def repeat(self, count, tool, *arguments):
        return Run.median([self.run(tool, *arguments) for _ in range(count)])


def readable_bytes(size):
    return f"{size / 1e6:.2f} MB" if size >= 1e5 else f"{size / 1e3:.1f} kB"


def readable_time(nanoseconds):
    return f"{nanoseconds:.0f} ns" if nanoseconds < 1e3 else f"{nanoseconds / 1e3:.1f} us"
