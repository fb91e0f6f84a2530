"""The machine of a measurement, for pages that show its figures."""

import os
import pathlib
import platform
import subprocess


def machine():
    """What a page says of this machine. The load is that before the measurement, if this is called before it."""
    model = next(
        (line.split(":")[1].strip() for line in open("/proc/cpuinfo") if line.startswith("model name")), platform.machine()
    )
    revision = subprocess.run(
        ["git", "describe", "--always", "--dirty"], capture_output=True, text=True, cwd=pathlib.Path(__file__).parent
    )
    return {
        "processor": model,
        "cores": os.cpu_count(),
        "system": platform.platform(),
        "load": os.getloadavg()[0],
        "revision": revision.stdout.strip(),
    }


def machine_text(of):
    """A dictionary of machine() as a sentence."""
    return "{processor}, {cores} cores; load {load:.1f} before the run; revision {revision}.".format(**of)
