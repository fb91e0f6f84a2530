"""glint-wang: tiles by the text of the specification, parts of the plane, and what it refuses."""

import json
import shutil

import h5py
import numpy as np
import pytest
from conftest import run_all, run_once

MASK = 2**64 - 1
G, Y = 0x9E3779B97F4A7C15, 0xD1342543DE82EF95
FAR = 2**40


def result(process):
    assert process.returncode == 0, process.stderr
    return json.loads(process.stdout)["result"]


@pytest.fixture
def normals(glint):
    run_once(glint, "synth isotropic --size 160x120 --alpha .3 -o map.exr", "ingest map.exr -o n.glint --texel-size-um 3")
    return glint.folder / "n.glint"


class Plane:
    """The plane of an asset, by section 14 of the specification alone."""

    def __init__(self, path):
        with h5py.File(path) as file:
            a = file.attrs
            self.size, self.count, self.seed = int(a["tile_size"]), int(a["tile_count"]), int(a["plane_seed"])
            self.scheme = bytes(a["scheme"]).decode()
            self.h, self.v = int(a["colors_h"]), int(a["colors_v"])
            self.normals = np.array(file["normals"])

    @staticmethod
    def mix(z):
        z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9 & MASK
        z = (z ^ (z >> 27)) * 0x94D049BB133111EB & MASK
        return z ^ (z >> 31)

    def below(self, n, i, j, s):
        key = self.mix((self.seed * G + G) & MASK)
        h = self.mix((self.mix((key + G * (i & MASK)) & MASK) + Y * (j & MASK) + s) & MASK)
        return ((h >> 32) * n) >> 32

    def tile(self, i, j):
        def east(x, y):
            return self.below(self.h, x, y, 0)

        def north(x, y):
            return self.below(self.v, x, y, 1)

        if self.scheme == "edge":
            c = east(i, j), east(i, j + 1), north(i, j), north(i + 1, j)
        else:
            c = east(i, j), east(i + 1, j), east(i, j + 1), east(i + 1, j + 1)
        variants = self.count // (self.h * self.v) ** 2
        first = variants * (((c[0] * self.h + c[1]) * self.v + c[2]) * self.v + c[3])
        return first + (self.below(variants, i, j, 2) if variants > 1 else 0)

    def part(self, x, y, width, height):
        out = np.empty((height, width, 2), np.float32)
        for j in range(height):
            for i in range(width):
                cell, at = divmod(x + i, self.size), divmod(y + j, self.size)
                out[j, i] = self.normals[self.tile(cell[0], at[0]), at[1], cell[1]]
        return out


@pytest.mark.parametrize(
    "flags", ["--scheme corner", "--scheme edge", "--scheme edge --colors 2,3 --tiles 72", "--colors 2 --tiles 48"]
)
def test_a_part_of_the_plane_is_what_the_specification_says(glint, normals, flags):
    run_all(glint, f"wang n.glint -o w.glint --size 20 --seed 5 {flags}")
    assert glint("validate", "w.glint").returncode == 0
    plane = Plane(glint.folder / "w.glint")
    assert plane.count == {"--scheme edge --colors 2,3 --tiles 72": 72, "--colors 2 --tiles 48": 48}.get(flags, 16)
    for x, y in ((0, 0), (-33, 7), (FAR + 5, -FAR)):
        run_all(glint, f"wang w.glint --explicit 70 45 --origin {x} {y} -o part.glint --force")
        assert glint("validate", "part.glint").returncode == 0
        with h5py.File(glint.folder / "part.glint") as file:
            assert np.array_equal(np.array(file["normals"]), plane.part(x, y, 70, 45))
            assert file.attrs["texel_size_um"] == 3


def test_the_report_is_in_the_asset(glint, normals):
    report = result(glint("wang", "n.glint", "-o", "w.glint", "--size", 40, "--json"))
    assert report["tiles"] == 16 and report["size_bytes"] == 16 * 40 * 40 * 8
    with h5py.File(glint.folder / "w.glint") as file:
        for name in ("seam_cost", "ndf_tv", "repetition"):
            assert file.attrs[name] == pytest.approx(report[name], rel=1e-6)
    found = result(glint("info", "w.glint", "--json"))
    assert found["properties"]["tile_size"] == 40 and found["properties"]["scheme"] == "corner"
    text = glint("wang", "n.glint", "-o", "w.glint", "--size", 40, "--verbose").stdout
    assert "16 tiles of 40 x 40" in text and "repetition" in text


def test_the_same_bytes_on_any_number_of_threads(glint, normals):
    run_all(glint, "wang n.glint -o w.glint --size 24 --threads 1")
    one = (glint.folder / "w.glint").read_bytes()
    run_all(glint, "wang n.glint -o w.glint --size 24 --threads 2")
    assert (glint.folder / "w.glint").read_bytes() == one
    run_all(glint, "wang n.glint -o w.glint --size 24 --seed 2")
    assert (glint.folder / "w.glint").read_bytes() != one


def test_maps_of_any_shape_become_tiles(glint):
    for size, tile in (("300x17", 32), ("16", 16), ("33x90", 64), ("130", 64)):
        run_all(glint, f"synth flakes --size {size} -o map.exr", "ingest map.exr -o n.glint --force")
        process = glint("wang", "n.glint", "-o", "w.glint", "--size", tile, "--json")
        report = result(process)
        smaller = min(map(int, size.split("x")))
        assert report["enlarged"] == (smaller < tile + 2 * 4)
        assert ("larger than half the map" in process.stderr) == (2 * tile > smaller)
        assert glint("validate", "w.glint").returncode == 0


def test_a_map_that_repeats_is_cut_across_its_border(glint):
    run_all(glint, "synth isotropic --size 48 --alpha .3 -o map.exr", "ingest map.exr -o n.glint")
    assert result(glint("wang", "n.glint", "-o", "w.glint", "--size", 48, "--boundary", "wrap", "--json"))["enlarged"] is False
    assert glint("validate", "w.glint").returncode == 0


def test_a_constant_map_is_a_constant_plane(glint):
    run_all(glint, "synth flat --size 40 -o map.exr", "ingest map.exr --allow-constant -o n.glint")
    report = result(glint("wang", "n.glint", "-o", "w.glint", "--size", 20, "--json"))
    assert (report["seam_cost"], report["ndf_tv"], report["repetition"]) == (0, 0, 0)


BAD = {
    "--colors 1": (1, "one tile"),
    "--colors 9": (1, "--colors"),
    "--colors two": (1, "--colors"),
    "--colors 2,3": (1, "--scheme edge"),
    "--tiles 20": (1, "give 16"),
    "--scheme edge --colors 2,3 --tiles 16": (1, "give 36"),
    "--size 8": (1, "--size"),
    "--size 40 --overlap 11": (1, "quarter of --size"),
    "--origin 3 4": (1, "--explicit"),
    "--explicit 10 10 --size 20": (1, "--explicit"),
    "--explicit 10 10 --origin 1.5 0": (1, "whole number"),
    "--explicit 1000000 1000000": (1, "several parts"),
    "--explicit 10 10": (5, "wang-tiles"),
}


@pytest.mark.parametrize("flags", BAD)
def test_what_cannot_be_is_refused(glint, normals, flags):
    process = glint("wang", "n.glint", "-o", "w.glint", *flags.split())
    code, text = BAD[flags]
    assert process.returncode == code and text in process.stderr
    assert len(process.stderr.splitlines()) == 1
    assert not (glint.folder / "w.glint").exists()


def test_tiny_maps_and_other_kinds_are_refused(glint, normals):
    run_all(
        glint, "synth isotropic --size 15x200 -o tiny.exr", "ingest tiny.exr -o tiny.glint", "wang n.glint -o w.glint --size 24"
    )
    process = glint("wang", "tiny.glint", "-o", "out.glint", "--size", 16)
    assert process.returncode == 3 and "tiny.glint" in process.stderr and "16 x 16" in process.stderr
    process = glint("wang", "w.glint", "-o", "out.glint")
    assert process.returncode == 5 and "--explicit" in process.stderr
    for tool in ("sat", "moments", "binmap"):
        process = glint(tool, "w.glint", "-o", "out.glint", *(["--alpha", ".1"] if tool == "binmap" else []))
        assert process.returncode == 5 and "wang-tiles" in process.stderr


def test_damaged_sides_and_texels_are_found(glint, normals):
    run_all(glint, "wang n.glint -o w.glint --size 24")
    for place, value, rule in (
        ((3, 0, 5, 0), 0.5, "wang.sides"),
        ((2, 9, 9, 1), float("nan"), "wang.disk"),
        ((5, 8, 8), (0.98, 0), "wang.slopes"),
    ):
        shutil.copy(glint.folder / "w.glint", glint.folder / "bad.glint")
        with h5py.File(glint.folder / "bad.glint", "r+") as file:
            file["normals"][place] = value
        process = glint("validate", "bad.glint")
        assert process.returncode == 3 and rule in process.stdout + process.stderr
        assert glint("wang", "bad.glint", "--explicit", 20, 20, "-o", "part.glint").returncode == 3


@pytest.mark.parametrize("size", ["--sigma 3", "--cov 30 -12 9", "--box 9 2 -3 6", "--sigma 20"])
@pytest.mark.parametrize("surface", ["flat", "smooth"])
def test_the_plane_answers_as_a_map_of_it_does(glint, normals, size, surface):
    run_all(glint, "wang n.glint -o w.glint --size 24 --seed 3")
    half = 2 * 150
    for x, y in ((12.25, 7.5), (24 * 5 + 0.5, -24 * 2 - 0.25), (FAR + 8.75, -FAR - 0.5)):
        left, low = int(np.floor(x)) - half, int(np.floor(y)) - half
        run_all(glint, f"wang w.glint --explicit {2 * half} {2 * half} --origin {left} {low} -o part.glint --force")
        at = f"--uv {(x - left) / (2 * half)} {(y - low) / (2 * half)} {size} --surface {surface} --sigma-r .05"
        for asked in ("--half .1 -.05", "--range -.2 -.1 .1 .3"):
            expected = float(glint("query", "part.glint", *at.split(), *asked.split(), "--boundary", "clamp").stdout)
            process = glint(
                "query",
                "plane",
                "w.glint",
                "--texel",
                x,
                y,
                *size.split(),
                "--surface",
                surface,
                "--sigma-r",
                ".05",
                *asked.split(),
            )
            assert float(process.stdout) == pytest.approx(expected, rel=1e-3), process.stderr


def test_images_of_tiles_answer_as_a_pyramid_of_the_plane_does(glint, normals):
    """With an overlap of 1 the centres of a map of the plane are those of its tiles."""
    ends = 0.02  # footprints end at a square of 3.2 deviations, or at a circle of 3.5; densities are of single half vectors
    compressed = 0.15  # --tolerance .05 in the mean over all half vectors and places
    size, options = 64, "--stride 8 --overlap 1 --resolution 64 --sigma-r .05"
    run_all(
        glint,
        f"wang n.glint -o w.glint --size {size} --seed 3",
        f"pyramid w.glint -o wp.glint {options}",
        "compress wp.glint -o wc.glint --tolerance .05",
    )
    for x, y in ((12.25, 7.5), (size * 5 + 0.5, -size * 2 - 0.25), (FAR + 8.75, -FAR - 0.5)):
        left, low = (int(np.floor(v / size) - 4) * size for v in (x, y))
        width = 8 * size
        run_all(
            glint,
            f"wang w.glint --explicit {width} {width} --origin {left} {low} -o part.glint --force",
            f"pyramid part.glint -o part-pyramid.glint {options} --boundary clamp --force",
        )
        at = f"--uv {(x - left) / width} {(y - low) / width}"
        for asked in ("--sigma 5 --half .1 -.05", "--sigma 9 --range -.2 -.1 .1 .3", "--cov 30 -12 29 --half 0 0"):
            expected = float(glint("query", "part-pyramid.glint", *at.split(), *asked.split()).stdout)
            for asset, tolerance in (("wp.glint", ends), ("wc.glint", compressed)):
                process = glint("query", "plane", asset, "--texel", x, y, *asked.split())
                assert float(process.stdout) == pytest.approx(expected, rel=tolerance), (asset, asked, process.stderr)


def test_a_plane_of_images_has_no_smooth_surface(glint, normals):
    run_all(glint, "wang n.glint -o w.glint --size 24")
    process = glint("pyramid", "w.glint", "-o", "out.glint", "--surface", "smooth")
    assert process.returncode == 5 and "--surface" in process.stderr and not (glint.folder / "out.glint").exists()


def test_pictures_of_the_plane(glint, normals):
    run_all(
        glint,
        "wang n.glint -o w.glint --size 24",
        "query plane w.glint --texel 5 5 --sigma 4 --image ndf.exr --image-size 32 --sigma-r .05",
    )
    assert (glint.folder / "ndf.exr").exists()


PLANE = "query plane w.glint --texel 3 4"
BAD_QUERIES = {
    f"{PLANE} --half 0 0": (1, "no size"),
    f"{PLANE} --sigma 3": (1, "nothing was asked"),
    f"{PLANE} --cov 1 5 1 --half 0 0": (1, "--cov"),
    "query plane w.glint --texel 1e300 0 --sigma 3 --half 0 0": (1, "--texel"),
    "query plane w.glint --sigma 3 --half 0 0": (1, "--texel"),
    "query plane n.glint --texel 0 0 --sigma 3 --half 0 0": (5, "wang-tiles"),
    "query w.glint --texel 5 5 --sigma 3 --half 0 0": (1, "glint-query plane"),
}


@pytest.mark.parametrize("command", BAD_QUERIES)
def test_questions_that_cannot_be_are_refused(glint, normals, command):
    run_all(glint, "wang n.glint -o w.glint --size 24")
    process = glint(*command.split())
    code, text = BAD_QUERIES[command]
    assert process.returncode == code and text in process.stderr and process.stdout == ""
