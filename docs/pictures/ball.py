"""Draws ball.png: a ball of copper flakes with one texel for each pixel, with one roughness for all, with glint, and by brute force.

Run it by hand, after make build: python3 docs/pictures/ball.py. Brute force takes a minute.
"""

import argparse
import ctypes
import pathlib
import subprocess
import tempfile

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
import PIL.Image

HERE = pathlib.Path(__file__).parent
SIZE = 250  # pixels of a ball's picture
MAP = 1024  # texels
REPEATS = (18, 9)  # of the map round the ball and from pole to pole
PIXEL_FILTER = 0.5  # deviation, pixels
LIGHTS = [
    ((-0.5, 0.6, 0.62), 2.6),
    ((0.75, 0.25, 0.6), 1.2),
    ((0.1, -0.5, 0.86), 0.7),
]  # direction (x right, y up, z to the eye), strength
ETA, K = (0.20, 0.92, 1.10), (3.91, 2.45, 2.14)  # copper
BASE = np.array([0.09, 0.02, 0.012])  # paint under the flakes
SPECKS = 0.35  # share of the ball that is flakes


class Floats(ctypes.Structure):
    _fields_ = [("data", ctypes.c_void_p), ("stride", ctypes.c_ssize_t)]


def columns(array):
    """(array of floats, [Floats of each of its columns]): the array has to live as long as these are used."""
    array = np.ascontiguousarray(array, np.float32)
    return array, [Floats(array.ctypes.data + 4 * k, array.strides[0]) for k in range(array.shape[1])]


class Footprints(ctypes.Structure):
    _fields_ = [
        (name, Floats)
        for name in (
            "u",
            "v",
            "sigma",
            "xx",
            "xy",
            "yy",
            "ax",
            "ay",
            "bx",
            "by",
            "precise_u",
            "precise_v",
            "spread_x",
            "spread_y",
        )
    ]


class Directions(ctypes.Structure):
    _fields_ = [(name, Floats) for name in "xyz"]


class OpenOptions(ctypes.Structure):
    _fields_ = [("struct_size", ctypes.c_size_t), ("normals_path", ctypes.c_char_p), ("rest", ctypes.c_int32 * 8)]


class BrdfOptions(ctypes.Structure):
    _fields_ = [
        ("struct_size", ctypes.c_size_t),
        ("fresnel", ctypes.c_int32),
        ("facets", ctypes.c_int32),
        ("eta", ctypes.c_float * 3),
        ("k", ctypes.c_float * 3),
    ]


class Brdf:
    """A copper BRDF of an asset, through glint.h."""

    def __init__(self, library, path, normals=None):
        self.library = library
        ndf, self.brdf = ctypes.c_void_p(), ctypes.c_void_p()
        options = OpenOptions(ctypes.sizeof(OpenOptions), str(normals).encode() if normals else None)
        self.check(library.glint_ndf_open(str(path).encode(), ctypes.byref(options), ctypes.byref(ndf)))
        copper = BrdfOptions(ctypes.sizeof(BrdfOptions), 2, 0, ETA, K)
        self.check(library.glint_brdf_create(ndf, ctypes.byref(copper), ctypes.byref(self.brdf)))

    def check(self, status):
        if status:
            self.library.glint_error_message.restype = ctypes.c_char_p
            raise RuntimeError(self.library.glint_error_message().decode())

    def evaluate(self, uv, covariance, wi, wo):
        """[pixels][3]: the BRDF of each pixel."""
        f = np.zeros((len(uv), 3), np.float32)
        arrays, floats = zip(*map(columns, (uv, covariance, wi, wo)))
        footprints = Footprints(u=floats[0][0], v=floats[0][1], xx=floats[1][0], xy=floats[1][1], yy=floats[1][2])
        self.check(
            self.library.glint_brdf_evaluate_batch(
                self.brdf,
                ctypes.c_size_t(len(arrays[0])),
                ctypes.byref(footprints),
                ctypes.byref(Directions(*floats[2])),
                ctypes.byref(Directions(*floats[3])),
                ctypes.c_void_p(f.ctypes.data),
                None,
            )
        )
        return f


def ball():
    """Pixels that see the ball: (which, normals, tangents u, tangents v, uv, covariances of their footprints in texels^2)."""
    ticks = (np.arange(SIZE) + 0.5) / SIZE * 2.1 - 1.05
    x, y = np.meshgrid(ticks, -ticks)
    seen = x**2 + y**2 < 0.995
    n = np.stack([x[seen], y[seen], np.sqrt(1 - x[seen] ** 2 - y[seen] ** 2)], axis=1)
    along = (
        np.stack([n[:, 2], np.zeros(len(n)), -n[:, 0]], axis=1) / np.hypot(n[:, 0], n[:, 2])[:, None]
    )  # growing azimuth round y
    up = np.cross(n, along)
    azimuth, height = np.arctan2(n[:, 0], n[:, 2]), np.arcsin(n[:, 1])
    uv = np.stack([azimuth / (2 * np.pi) * REPEATS[0], height / np.pi * REPEATS[1]], axis=1)
    pixel = 2.1 / SIZE
    radius = np.hypot(n[:, 0], n[:, 2])
    changes = []
    for axis in (np.array([1.0, 0, 0]), np.array([0, -1.0, 0])):
        step = pixel * (
            axis - np.array([0, 0, 1.0]) * (n @ axis)[:, None] / n[:, 2:3]
        )  # along the ball, for a step in the picture
        du = np.einsum("ij,ij->i", step, along) / radius / (2 * np.pi) * REPEATS[0]
        dv = np.einsum("ij,ij->i", step, up) / np.pi * REPEATS[1]
        changes.append(PIXEL_FILTER * MAP * np.stack([du, dv], axis=1))
    a, b = changes
    covariance = np.stack(
        [a[:, 0] ** 2 + b[:, 0] ** 2, a[:, 0] * a[:, 1] + b[:, 0] * b[:, 1], a[:, 1] ** 2 + b[:, 1] ** 2], axis=1
    )
    return seen, n, along, up, uv, covariance


def picture(brdf, scene, covariance):
    """[SIZE][SIZE][3], as a screen shows it."""
    seen, n, along, up, uv, _ = scene
    local = lambda w: np.stack([along @ w, up @ w, n @ w], axis=1)
    wo = local(np.array([0, 0, 1.0]))
    light = np.zeros((len(n), 3))
    for direction, strength in LIGHTS:
        wi = local(np.array(direction) / np.linalg.norm(direction))
        cosine = np.maximum(wi[:, 2:3], 0)
        light += strength * cosine * (SPECKS * brdf.evaluate(uv, covariance, wi, wo) + BASE)
    image = np.ones((SIZE, SIZE, 3))
    image[seen] = (1 - np.exp(-1.6 * light)) ** (1 / 2.2)
    return image


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--build", type=pathlib.Path, default=HERE.parents[1] / "build")
    build = parser.parse_args().build
    library = ctypes.CDLL(str(build / "libglint/libglint.so"))
    with tempfile.TemporaryDirectory() as folder:
        path = lambda name: pathlib.Path(folder) / name
        run = lambda tool, *words: subprocess.run([build / "bin" / f"glint-{tool}", *map(str, words)], check=True)
        run("synth", "flakes", "-o", path("map.exr"), "--size", MAP, "--flake-size", 6, "--seed", 7)
        run("ingest", path("map.exr"), "-o", path("map.glint"))
        run("pyramid", path("map.glint"), "-o", path("map.pyramid.glint"), "--stride", 16)
        run("compress", path("map.pyramid.glint"), "-o", path("map.cp.glint"), "--tolerance", 0.1)
        # One roughness for all pixels, as a mip map of normals has it far away: the mean of the map, blurred until no flake is left.
        run("pyramid", path("map.glint"), "-o", path("map.blurred.glint"), "--sigma-r", 0.05, "--levels", 1)
        scene = ball()
        covariance = scene[-1]
        texel = np.tile([0.01, 0, 0.01], (len(covariance), 1))
        whole = np.tile([4.0 * MAP**2, 0, 4.0 * MAP**2], (len(covariance), 1))
        normals, blurred = Brdf(library, path("map.glint")), Brdf(library, path("map.blurred.glint"))
        answers = Brdf(library, path("map.cp.glint"), path("map.glint"))
        pictures = {
            "one texel for each pixel": picture(normals, scene, texel),
            "one roughness for all": picture(blurred, scene, whole),
            "glint": picture(answers, scene, covariance),
            "all texels under each pixel": picture(normals, scene, covariance),
        }
    figure, axes = plt.subplots(1, len(pictures), figsize=(len(pictures) * SIZE / 100, SIZE / 100 + 0.3), dpi=100)
    for axis, (title, image) in zip(axes, pictures.items()):
        axis.imshow(image, interpolation="nearest")
        axis.set_title(title, fontsize=10)
        axis.axis("off")
    figure.subplots_adjust(left=0, right=1, bottom=0, top=1 - 0.3 / figure.get_figheight(), wspace=0)
    figure.savefig(HERE / "ball.png")
    PIL.Image.open(HERE / "ball.png").convert("RGB").save(HERE / "ball.png", optimize=True)


if __name__ == "__main__":
    main()
