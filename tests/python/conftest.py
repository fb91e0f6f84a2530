"""Fixtures of the tests of the package. They run in the environment that `make python` makes."""

import os
import pathlib
import subprocess

import numpy as np
import pytest

import glint_ndf as gn

BIN = pathlib.Path(os.environ.get("GLINT_BIN_DIR", "build/bin")).resolve()


@pytest.fixture(scope="session")
def run_tool():
    """Runs a command-line tool; returns its output."""

    def run(*words):
        done = subprocess.run([BIN / words[0], *map(str, words[1:])], capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stderr
        return done.stdout

    return run


@pytest.fixture(scope="session")
def flakes():
    """A map of flakes that is no square."""
    return gn.synth("flakes", 192, 128, seed=3)


@pytest.fixture(scope="session")
def noise():
    return gn.synth("isotropic", 256, seed=2)


@pytest.fixture(scope="session")
def pyramid(noise):
    return gn.pyramid(noise, sigma_r=0.02)


@pytest.fixture
def random():
    return np.random.default_rng(1)
