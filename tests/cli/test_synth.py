"""glint-synth."""

import json
import time
import signal
import subprocess

import h5py
import numpy as np
import OpenImageIO as oiio
import pytest
from conftest import BIN

KINDS = [
    "isotropic",
    "brushed",
    "flakes",
    "scratches",
    "leather",
    "weave",
    "twill",
    "silk",
    "bumps",
    "scales",
    "structured",
    "relief",
    "wood",
    "anisotropic",
    "sawtooth",
    "flat",
    "grating",
    "flake2d",
]


@pytest.mark.parametrize("kind", KINDS)
def test_every_kind_is_ingested(glint, kind):
    assert glint("synth", kind, "--size", "64x48", "-o", "a.exr").returncode == 0
    allow = ["--allow-constant"] if kind == "flat" else []
    process = glint("ingest", "a.exr", "-o", "a.glint", "--json", *allow)
    assert process.returncode == 0, process.stderr
    report = json.loads(process.stdout)["result"]
    assert report["texels"] == 64 * 48
    assert report["non_unit"] == report["downward"] == report["non_finite"] == 0


def test_success_is_silent(glint):
    process = glint("synth", "flakes", "--size", "8", "-o", "a.png")
    assert (process.returncode, process.stdout, process.stderr) == (0, "", "")


def test_same_bytes_for_any_number_of_threads(glint):
    for threads in (1, 2):
        glint("synth", "isotropic", "--size", "100x60", "-o", f"{threads}.exr", "--threads", threads)
    assert (glint.folder / "1.exr").read_bytes() == (glint.folder / "2.exr").read_bytes()


def test_heights_give_the_same_normals(glint):
    glint("synth", "isotropic", "--size", "64", "-o", "n.exr")
    glint("synth", "isotropic", "--size", "64", "-o", "h.exr", "--height")
    direct = json.loads(glint("ingest", "n.exr", "-o", "n.glint", "--json").stdout)["result"]["slope_covariance"]
    derived = json.loads(glint("ingest", "h.exr", "--kind", "height", "-o", "h.glint", "--json").stdout)["result"]
    # Encoding to 0..1 rounds normals to 6e-8.
    assert derived["slope_covariance"]["xx"] == pytest.approx(direct["xx"], rel=1e-5)


@pytest.mark.parametrize(
    "arguments, code",
    [
        (["flakse", "-o", "a.exr"], 1),
        (["flakes"], 1),
        (["flakes", "-o", "a.exr", "--size", "8y8"], 1),
        (["flakes", "-o", "a.exr", "--size", "0"], 1),
        (["flakes", "-o", "a.exr", "--size", "99999999999"], 1),
        (["flakes", "-o", "a.exr", "--alpha", "3"], 1),
        (["flakes", "-o", "a.nonsense"], 1),
        (["flakes", "-o", "a.png", "--bits", "32"], 1),
        (["isotropic", "-o", "a.png", "--height"], 1),
        (["flakes", "-o", "no/such/folder/a.exr"], 2),
        (["flakes", "-o", "a.exr", "--height"], 5),
        (["flake2d", "-o", "a.exr", "--height"], 5),
        (["flake2d", "-o", "a.exr", "--height", "--presence"], 1),
        (["flakes", "-o", "a.exr", "--presence"], 1),
        (["flakes", "-o", "a.exr", "--coverage", ".5"], 1),
        (["flake2d", "-o", "a.exr", "--flake-size", "6"], 1),
        (["flake2d", "-o", "a.exr", "--alpha", ".1"], 1),
        (["flake2d", "-o", "a.exr", "--coverage", "1.1"], 1),
    ],
)
def test_wrong_use_is_refused_and_leaves_nothing(glint, arguments, code):
    process = glint("synth", *arguments, *([] if "--size" in arguments else ["--size", "8"]))
    assert process.returncode == code, process.stderr
    assert process.stderr.startswith("glint-synth: error: ")
    assert list(glint.folder.iterdir()) == []


@pytest.mark.parametrize("delay_s", [0.02, 0.3, 0.6])
def test_a_killed_run_leaves_no_output(glint, delay_s):
    command = [BIN / "glint-synth", "leather", "--size", "4096", "-o", "a.exr"]
    process = subprocess.Popen(command, cwd=glint.folder)
    time.sleep(delay_s)
    process.send_signal(signal.SIGKILL)
    assert process.wait() == -signal.SIGKILL
    assert not (glint.folder / "a.exr").exists()


class Flake2d:
    """MaterialX's node flake2d by its definition (stdlib, 1.39.5), in numpy: every texel asks the 27 cells around it."""

    def __init__(self, width, height, size, roughness, coverage, plane=0):
        f = np.float32
        u, v = np.meshgrid((np.arange(width, dtype=f) + f(0.5)) / f(width), (np.arange(height, dtype=f) + f(0.5)) / f(width))
        position = np.stack([u, v, np.zeros_like(u)], -1) / f(size)
        self.cells = np.floor(position).astype(np.int64)
        self.presence = np.zeros((height, width), f)
        owner = np.zeros((height, width, 3), np.int64)
        x = np.float64(coverage)
        probability = (-26.19771808 * x * x + 26.39663835 * x) / (
            85.53857017 * x**3 - 102.35069432 * x * x - 101.42634862 * x + 118.45082288
        )
        half_edge = 1.5 / np.sqrt(3)
        for offset in np.ndindex(3, 3, 3):
            cell = self.cells + np.array(offset) - 1
            local = position.astype(np.float64) - cell - 0.5
            key = [cell[..., 0], cell[..., 1], cell[..., 2] + plane]
            candidate = ((local**2).sum(-1) < 3 * half_edge**2) & (self.number(key) <= probability)
            presence = self.number([*key, 3])
            candidate &= presence >= self.presence
            turned = self.turned(local, *(self.number([*key, i]) for i in range(3)))
            candidate &= (np.abs(turned) <= half_edge).all(-1)
            self.presence[candidate] = presence[candidate]
            owner[candidate] = np.stack(key, -1)[candidate]
        xi = [self.number([owner[..., 0], owner[..., 1], owner[..., 2], 2, i]) for i in range(2)]
        tangent = roughness**2 * np.sqrt(xi[1]) / np.sqrt(np.maximum(1 - xi[1], 1e-12))
        sine = np.where(self.presence > 0, tangent / np.sqrt(1 + tangent**2), 0)
        self.normals = np.stack([np.cos(2 * np.pi * xi[0]) * sine, np.sin(2 * np.pi * xi[0]) * sine], -1)

    @staticmethod
    def number(key):
        """lookup3 of Bob Jenkins over the words of the key, as a number from 0 to 1."""
        key = [np.asarray(word).astype(np.int64).astype(np.uint32) for word in key]
        rot = lambda a, bits: (a << np.uint32(bits)) | (a >> np.uint32(32 - bits))
        state = [np.full(key[0].shape, (0xDEADBEEF + 4 * len(key) + 13) & 0xFFFFFFFF, np.uint32) for _ in range(3)]
        for i in range(3):
            state[i] = state[i] + key[i]
        if len(key) > 3:
            for i, bits in enumerate((4, 6, 8, 16, 19, 4)):
                a, b, c = i % 3, (i + 1) % 3, (i + 2) % 3
                state[a] = (state[a] - state[c]) ^ rot(state[c], bits)
                state[c] = state[c] + state[b]
            for i, word in enumerate(key[3:]):
                state[i] = state[i] + word
        for i, bits in enumerate((14, 11, 25, 16, 4, 14, 24)):
            target, source = (2 + i) % 3, (1 + i) % 3
            state[target] = (state[target] ^ state[source]) - rot(state[source], bits)
        return state[2].astype(np.float64) / 0xFFFFFFFF

    @staticmethod
    def turned(p, a, b, c):
        """Arvo's random rotation: a Householder reflection through v times a rotation about z, negated."""
        theta, phi, z = 2 * np.pi * a, 2 * np.pi * b, 2 * c
        v = np.stack([np.sin(phi) * np.sqrt(z), np.cos(phi) * np.sqrt(z), np.sqrt(2 - z)], -1)
        # The node's matrix is that of (v v^T - I) R, stored by columns: rotate about z after the reflection.
        reflected = v * (v * p).sum(-1, keepdims=True) - p
        x = np.cos(theta) * reflected[..., 0] - np.sin(theta) * reflected[..., 1]
        y = np.sin(theta) * reflected[..., 0] + np.cos(theta) * reflected[..., 1]
        return np.stack([x, y, reflected[..., 2]], -1)


EDGE_SHARE = 2e-4  # texels on the edge of a flake, where float and double decide differently
NORMAL_ROUNDING = 1e-5  # floats of the tool, and of the file


def read(path):
    pixels = oiio.ImageInput.open(str(path)).read_image("float")
    return np.flipud(pixels)


@pytest.mark.parametrize(
    "width, height, size, roughness, coverage, seed",
    [
        (256, 256, 0.03, 0.3, 0.5, 1),
        (200, 120, 0.0613, 0.5, 0.9, 1),
        (128, 192, 0.011, 0.2, 0.2, 8),
    ],
)
def test_flake2d_is_the_node_of_materialx(glint, width, height, size, roughness, coverage, seed):
    """Sizes that do not tile: every texel is the node's."""
    node = Flake2d(width, height, size, roughness, coverage, plane=seed - 1)
    arguments = [
        "flake2d",
        "--size",
        f"{width}x{height}",
        "--flake-size-uv",
        size,
        "--roughness",
        roughness,
        "--coverage",
        coverage,
        "--seed",
        seed,
    ]
    process = glint("synth", *arguments, "-o", "n.exr")
    assert process.returncode == 0 and "does not tile" in process.stderr
    assert glint("synth", *arguments, "--presence", "-o", "p.exr").returncode == 0
    presence = read(glint.folder / "p.exr")[..., 0]
    normals = read(glint.folder / "n.exr")[..., :2] * 2 - 1
    same = np.abs(presence - node.presence) < NORMAL_ROUNDING
    assert (~same).mean() < EDGE_SHARE
    assert 0.5 * coverage < (presence > 0).mean() < 1.2 * coverage + 0.05
    assert np.abs(normals - node.normals)[same].max() < NORMAL_ROUNDING


def test_flake2d_that_tiles_is_the_node_except_at_the_border(glint):
    node = Flake2d(256, 128, 1 / 16, 0.4, 0.6)
    process = glint(
        "synth",
        "flake2d",
        "--size",
        "256x128",
        "--flake-size-uv",
        1 / 16,
        "--roughness",
        ".4",
        "--coverage",
        ".6",
        "-o",
        "n.exr",
    )
    assert (process.returncode, process.stderr) == (0, "")
    differs = (np.abs(read(glint.folder / "n.exr")[..., :2] * 2 - 1 - node.normals) > NORMAL_ROUNDING).any(-1)
    assert differs[16:-16, 16:-16].mean() < EDGE_SHARE  # a cell is 16 texels
    assert differs.mean() > 0.01  # cells beyond the border are those of the other side


def test_flakes_of_flake2d_are_distributed_as_ggx(glint):
    """The share of the facets that are steeper than an angle: alpha^2 / (alpha^2 + tan^2)."""
    alpha = 0.4**2
    run = ["flake2d", "--size", "1000", "--flake-size-uv", ".005", "--roughness", ".4", "--coverage", "1"]
    assert glint("synth", *run, "-o", "n.exr").returncode == 0
    assert glint("ingest", "n.exr", "-o", "n.glint").returncode == 0
    with h5py.File(glint.folder / "n.glint") as file:
        n2 = (np.array(file["normals"], np.float64) ** 2).sum(-1)
    tangent2 = np.unique(np.round(n2[n2 > 0] / (1 - n2[n2 > 0]), 9))
    flakes = len(tangent2)
    assert flakes > 10000
    for tangent in (0.05, 0.1, 0.2, 0.5):
        share = alpha**2 / (alpha**2 + tangent**2)
        scatter = 4 * np.sqrt(share * (1 - share) / flakes)  # four standard errors
        assert (tangent2 > tangent**2).mean() == pytest.approx(share, abs=scatter)
