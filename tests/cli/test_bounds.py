"""Values at the ends of their ranges take seconds and little memory, or are usage errors that say what to give instead."""

import resource
import subprocess

import pytest
from conftest import BIN

# What a small map may take: far above what the tools need on a busy machine.
SECONDS = 60
BYTES = 4 << 30


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    path = tmp_path_factory.mktemp("bounds")
    for arguments in (
        ["synth", "isotropic", "--size", "256", "-o", "map.exr"],
        ["ingest", "map.exr", "-o", "map.glint"],
        ["pyramid", "map.glint", "-o", "pyramid.glint", "--resolution", "64", "--sigma-r", "0.02"],
    ):
        assert run(path, *arguments).returncode == 0
    (path / "lights.json").write_text(
        '{"lights": [{"type": "sphere", "centre": [0, 0, 5], "radius": 1, "radiance": [1, 1, 1]}]}'
    )
    return path


def run(folder, name, *arguments):
    limit = lambda: resource.setrlimit(resource.RLIMIT_AS, (BYTES, BYTES))
    return subprocess.run(
        [BIN / f"glint-{name}", *arguments], cwd=folder, capture_output=True, text=True, timeout=SECONDS, preexec_fn=limit
    )


@pytest.mark.parametrize(
    "arguments, remedy",
    [
        (["synth", "scratches", "--size", "256", "-o", "x.exr", "--flake-size", "65536"], ["--flake-size", "256"]),
        (
            ["synth", "scratches", "--size", "1024", "-o", "x.exr", "--flake-size", "1024", "--density", "64"],
            ["--density", "3.555,"],
        ),
        (["compress", "pyramid.glint", "-o", "x.glint", "--regions", "255", "--rank", "1"], ["--regions", "12"]),
        (
            [
                "shlobes",
                "--light",
                "lights.json",
                "-o",
                "x.glint",
                "--order",
                "4",
                "--area-height",
                "4096",
                "--area-samples",
                "64",
            ],
            ["--area-samples", "4"],
        ),
    ],
    ids=lambda value: " ".join(value[:4]),
)
def test_what_would_take_minutes_says_what_to_give_instead(folder, arguments, remedy):
    process = run(folder, *arguments)
    assert process.returncode == 1, process.stderr
    assert remedy[1] in process.stderr and remedy[0] in process.stderr
    assert not (folder / arguments[arguments.index("-o") + 1]).exists()


@pytest.mark.parametrize(
    "arguments",
    [
        ["pyramid", "map.glint", "-o", "y.glint", "--stride", "65536"],
        ["pyramid", "map.glint", "-o", "y.glint", "--stride", "2", "--resolution", "32", "--sigma-r", "0.25"],
        ["synth", "scratches", "--size", "256", "-o", "y.exr", "--flake-size", "256"],
        ["synth", "scratches", "--size", "1024", "-o", "y.exr", "--flake-size", "1024", "--density", "3.5"],
        ["synth", "scratches", "--size", "1x1024", "-o", "y.exr", "--flake-size", "64"],
        *(
            ["synth", kind, "--size", "256", "-o", "y.exr", "--flake-size", "65536"]
            for kind in ("flakes", "leather", "weave", "sawtooth")
        ),
        ["synth", "brushed", "--size", "256", "-o", "y.exr", "--correlation", "65536", "--streak", "65536"],
        ["compress", "pyramid.glint", "-o", "y.glint", "--regions", "8", "--rank", "1"],
        ["compress", "pyramid.glint", "-o", "y.glint", "--method", "pca", "--rank", "256"],
        ["binmap", "map.glint", "-o", "y.glint", "--alpha", "0.0005", "--leaf-size", "1024"],
        ["sat", "map.glint", "-o", "y.glint", "--bins", "64x32", "--stride", "128"],
        ["query", "map.glint", "--uv", "0.5", "0.5", "--sigma", "1e9", "--half", "0", "0"],
    ],
    ids=" ".join,
)
def test_the_ends_of_ranges_are_answered(folder, arguments):
    process = run(folder, *arguments)
    assert process.returncode == 0, process.stderr
