"""glint-tiny: the plane of an asset by the text of the specification, answers against the map that --explicit writes, and bad input."""

import json
import math

import h5py
import numpy as np
import pytest
from conftest import run_all, run_once

SIZE = 64
EXAMPLE = 16
MASK = (1 << 64) - 1
STEP = 0x9E3779B97F4A7C15
TURNS = {
    "rotation_deg": [0, 360],
    "scale": [0.6, 1.3],
    "stretch": [1, 1.2],
    "shear": [-0.2, 0.1],
    "mirror": 0.5,
    "heights": [0.8, 1.25],
}
SCATTERED = "--mode scattered --density 1.5 --transforms turns.json --seed 5 --resolution 64 --sigma-r .03"


@pytest.fixture
def normals(glint):
    run_once(glint, f"synth isotropic --size {SIZE} --alpha .3 --correlation 3 -o map.exr", "ingest map.exr -o n.glint")
    (glint.folder / "turns.json").write_text(json.dumps(TURNS))
    return stored(glint.folder / "n.glint")


def stored(path):
    with h5py.File(path) as file:
        return np.array(file["normals"])


def number(process):
    assert process.returncode == 0, process.stderr
    return float(process.stdout.split()[0])


def mix(z):
    z = (z ^ z >> 30) * 0xBF58476D1CE4E5B9 & MASK
    z = (z ^ z >> 27) * 0x94D049BB133111EB & MASK
    return z ^ z >> 31


class Plane:
    """A scattered plane, from the attributes of a file and section 13 of the specification."""

    def __init__(self, path):
        with h5py.File(path) as file:
            self.attributes = {name: file.attrs[name] for name in file.attrs}
            self.normals = np.array(file["normals"]).reshape(EXAMPLE, EXAMPLE, 2)
        self.n = EXAMPLE
        mean, total, term = float(self.attributes["density"]), 0.0, math.exp(-float(self.attributes["density"]))
        self.thresholds = []
        for k in range(24):
            total += term
            self.thresholds.append(math.floor((2**32 - 1) * min(total, 1.0)))
            term *= mean / (k + 1)

    def drawn(self, name, xi):
        low, high = (float(x) for x in self.attributes[name])
        return low + xi * (high - low)

    def examples(self, i, j):
        """(centre, matrix, factor of heights) of the examples of a cell."""
        key = mix((mix((mix((int(self.attributes["seed"]) + STEP) & MASK) + i * STEP) & MASK) + j * STEP) & MASK)
        bits = mix(key) >> 32
        for k in range(sum(bits > threshold for threshold in self.thresholds)):
            a, b, c = (
                [(mix((key + STEP * (3 * k + s + 1)) & MASK) >> (21 * u + 1)) % 2**21 / 2**21 for u in range(3)]
                for s in range(3)
            )
            t, e, w = (self.drawn(name, xi) for name, xi in zip(("scale", "stretch", "shear"), b))
            angle, f = self.drawn("rotation", c[0]), self.drawn("heights", c[1])
            side = -1 if c[2] < float(self.attributes["mirror"]) else 1
            turn = np.array([[math.cos(angle), -math.sin(angle)], [math.sin(angle), math.cos(angle)]])
            matrix = turn @ np.array([[1, w], [0, 1]]) @ np.diag([t * e * side, t / e])
            yield self.n * np.array([i + a[0], j + a[1]]), matrix, f

    def at(self, p, overlap):
        """Normal that is seen at a point of the plane, and whether the point is near a border where floats may decide otherwise."""
        i, j = (int(math.floor(x / self.n)) for x in p)
        covering, doubtful = [], False
        for y in range(j - 2, j + 3):
            for x in range(i - 2, i + 3):
                for centre, matrix, f in self.examples(x, y):
                    local = np.linalg.solve(matrix, p - centre) + self.n / 2
                    doubtful |= bool(np.any(np.minimum(np.abs(local), np.abs(local - self.n)) < 1e-3)) or bool(
                        np.any(np.abs(local - np.round(local)) < 1e-3)
                    )
                    if np.all((local >= 0) & (local < self.n)):
                        covering.append((centre, matrix, f, local))
        if not covering:
            return np.zeros(2), doubtful
        place = p
        if overlap == "quarters":
            extents = [self.n / 2 * np.abs(matrix).sum(axis=1) for _, matrix, _, _ in covering]
            low = np.max([c[0] - e for c, e in zip(covering, extents)], axis=0)
            high = np.min([c[0] + e for c, e in zip(covering, extents)], axis=0)
            middle = (low + high) / 2
            place = np.where(p < middle, (low + middle) / 2, (middle + high) / 2)
        distances = sorted(((float(np.sum((c[0] - place) ** 2)), k) for k, c in enumerate(covering)))
        doubtful |= len(distances) > 1 and distances[1][0] - distances[0][0] < 1e-2
        _, matrix, f, local = covering[distances[0][1]]
        n = self.normals[int(local[1]), int(local[0])].astype(float)
        slopes = f * np.linalg.inv(matrix).T @ (-n / math.sqrt(1 - n @ n))
        return -slopes / math.sqrt(1 + slopes @ slopes), doubtful


@pytest.mark.parametrize("overlap", ["quarters", "nearest"])
def test_the_plane_is_that_of_the_specification(glint, normals, overlap):
    x0, y0, width, height = 999_983, -77, 40, 24
    run_all(
        glint,
        f"tiny n.glint -o t.glint --cut {EXAMPLE} --at 9 20 {SCATTERED} --overlap {overlap}",
        f"tiny t.glint -o e.glint --explicit {width} {height} --origin {x0} {y0}",
    )
    plane, written = Plane(glint.folder / "t.glint"), stored(glint.folder / "e.glint").reshape(height, width, 2)
    assert np.array_equal(plane.normals, normals[20 : 20 + EXAMPLE, 9 : 9 + EXAMPLE])
    compared = 0
    for j in range(height):
        for i in range(width):
            expected, doubtful = plane.at(np.array([x0 + i + 0.5, y0 + j + 0.5]), overlap)
            if doubtful:
                continue
            compared += 1
            assert written[j, i] == pytest.approx(expected, abs=1e-5)
    assert compared > 0.8 * width * height


def test_a_tiled_plane_is_moved_and_turned(glint, normals):
    transform = {"matrix": [[2, 0.5], [0, 1]], "offset": [3, -2], "heights": 1.5}
    (glint.folder / "m.json").write_text(json.dumps(transform))
    run_all(
        glint,
        f"tiny n.glint -o t.glint --cut {EXAMPLE} --transforms m.json --resolution 64 --sigma-r .03",
        "tiny t.glint -o e.glint --explicit 40 30 --origin -7 1099511627776",
    )
    written = stored(glint.folder / "e.glint").reshape(30, 40, 2)
    matrix = np.array(transform["matrix"])
    for j in range(30):
        for i in range(40):
            # 1099511627776 texels up: modulo the example in whole numbers first.
            p = np.array([-7 + i + 0.5 - 3, 1099511627776 % EXAMPLE + j + 0.5 + 2])
            p[0] -= 0.5 * (1099511627776 - 1099511627776 % EXAMPLE)
            x = np.linalg.solve(matrix, p) % EXAMPLE
            if np.any(np.abs(x - np.round(x)) < 1e-3):
                continue
            n = normals[int(x[1]), int(x[0])].astype(float)
            slopes = 1.5 * np.linalg.inv(matrix).T @ (-n / math.sqrt(1 - n @ n))
            assert written[j, i] == pytest.approx(-slopes / math.sqrt(1 + slopes @ slopes), abs=1e-5)


def test_answers_are_those_of_the_explicit_map(glint, normals):
    run_all(
        glint,
        f"tiny n.glint -o t.glint --cut {EXAMPLE} {SCATTERED}",
        "tiny t.glint -o e.glint --explicit 192 192 --per-texel 3",
    )
    differences, total = 0, 0
    for u, v in [(1.3, 2.2), (2.7, 1.4), (1.9, 2.9)]:
        for box in ["0 0 .5 .5", "-.25 -.25 .25 .25", "-.5 0 0 .5"]:
            ours = number(glint(*f"query t.glint --uv {u} {v} --sigma 1.5 --range {box}".split()))
            truth = number(glint(*f"query e.glint --uv {u / 4} {v / 4} --sigma 4.5 --sigma-r .03 --range {box}".split()))
            differences, total = differences + abs(ours - truth), total + truth
    assert differences < 0.15 * total


def test_positions_do_not_wrap(glint, normals):
    run_all(glint, f"tiny n.glint -o t.glint --cut {EXAMPLE} {SCATTERED}")
    ask = lambda u, v: number(glint(*f"query t.glint --uv {u} {v} --sigma 2 --half .05 .05".split()))
    here = ask(0.25, 0.5)
    assert len({here, ask(1.25, 0.5), ask(0.25, 7.5), ask(-1000000.75, 0.5)}) == 4
    (glint.folder / "q.csv").write_text("u,v,sigma,hx,hy\n1.25,.5,2,.05,.05\n0.25,7.5,2,.05,.05\n")
    run_all(glint, "query t.glint --csv q.csv -o a.csv")
    answers = [float(line.split(",")[-1]) for line in (glint.folder / "a.csv").read_text().splitlines()[1:]]
    assert answers == pytest.approx([ask(1.25, 0.5), ask(0.25, 7.5)], rel=1e-6)


def test_the_same_bytes_on_any_number_of_threads(glint, normals):
    for threads in (1, 2):
        run_all(glint, f"tiny n.glint -o t.glint --force --cut {EXAMPLE} {SCATTERED} --threads {threads}")
        if threads == 1:
            first = (glint.folder / "t.glint").read_bytes()
    assert first == (glint.folder / "t.glint").read_bytes()


@pytest.mark.parametrize(
    "options, code, text",
    [
        ("", 3, "64 x 48"),
        ("--cut 12", 3, "12 x 12"),
        ("--cut 32 --at 40 0", 1, "not inside"),
        ("--cut 16 --at 2147483647 0", 1, "not inside"),
        ("--cut 16 --transforms vast.json", 1, "at most 64"),
        ("--cut 16 --transforms dwarf.json", 1, "singular"),
        ("--cut 16 --density 2", 1, "--mode scattered"),
        ("--cut 16 --mode scattered --density 0", 1, "0.01 to 8"),
        ("--cut 16 --mode scattered --density 1000", 1, "0.01 to 8"),
        ("--cut 16 --transforms singular.json", 1, "singular"),
        ("--cut 16 --transforms inside_out.json", 3, "heights"),
        ("--cut 16 --transforms range.json", 3, "range"),
        ("--cut 16 --transforms unknown.json", 3, "twist"),
        ("--cut 16 --transforms text.json", 3, "JSON"),
        ("--cut 16 --mode scattered --transforms swapped.json", 3, "[low, high]"),
        ("--cut 16 --mode scattered --transforms large.json", 1, "reach"),
        ("--cut 16 --sigma-r .0001", 1, "tenth of a pixel"),
        ("--explicit 8 8", 5, "tiny-example"),
        ("--at 1 1", 1, "--cut"),
    ],
)
def test_bad_input_is_named(glint, options, code, text):
    run_all(glint, "synth isotropic --size 64x48 -o map.exr", "ingest map.exr -o n.glint")
    files = {
        "singular": '{"matrix": [[1, 2], [2, 4]]}',
        "inside_out": '{"heights": -1}',
        "range": '{"scale": [1, 2]}',
        "unknown": '{"twist": 1}',
        "text": "{scale: 1}",
        "swapped": '{"scale": [2, 1]}',
        "large": '{"scale": [1, 5]}',
        "vast": '{"scale": 2, "stretch": 40}',
        "dwarf": '{"matrix": [[1e-4, 0], [0, 1e-4]]}',
    }
    for name, content in files.items():
        (glint.folder / f"{name}.json").write_text(content)
    process = glint(*f"tiny n.glint -o t.glint {options}".split())
    assert process.returncode == code, process.stderr
    assert process.stderr.count("\n") == 1 and text in process.stderr, process.stderr
    assert not (glint.folder / "t.glint").exists()
