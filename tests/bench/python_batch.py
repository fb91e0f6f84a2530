"""Times a million densities through the Python package beside the same batch of the C interface: the cost of arrays of Python.

    build/venv/bin/python tests/bench/python_batch.py

Both run on one thread, in turns; medians of their ratios.
"""

import argparse
import ctypes
import pathlib
import statistics
import tempfile
import time

import numpy as np

import glint_ndf as gn

ROOT = pathlib.Path(__file__).parents[2]
QUERIES = 1_000_000
ROUNDS = 9


class Floats(ctypes.Structure):
    _fields_ = [("data", ctypes.c_void_p), ("stride", ctypes.c_ssize_t)]


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


def column(array, member):
    return Floats(array.ctypes.data + 4 * member, array.strides[0])


def batch_of_c(library, path):
    """A function of (uv, h, sigma, out) that asks the C interface once."""
    lib = ctypes.CDLL(str(library))
    ndf = ctypes.c_void_p()
    assert lib.glint_ndf_open(str(path).encode(), None, ctypes.byref(ndf)) == 0

    def ask(uv, h, sigma, out):
        footprints = Footprints(u=column(uv, 0), v=column(uv, 1), sigma=Floats(sigma.ctypes.data, 4))
        lib.glint_density_batch(
            ndf,
            ctypes.c_size_t(len(out)),
            ctypes.byref(footprints),
            column(h, 0),
            column(h, 1),
            out.ctypes.data_as(ctypes.c_void_p),
        )

    return ask


def seconds(work):
    start = time.perf_counter()
    work()
    return time.perf_counter() - start


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--library", default=ROOT / "build/libglint/libglint.so", help="the C interface")
    options = parser.parse_args()
    random = np.random.default_rng(1)
    uv, h = random.random((QUERIES, 2), dtype=np.float32), random.uniform(-0.3, 0.3, (QUERIES, 2)).astype(np.float32)
    sigma = np.exp(random.uniform(np.log(20), np.log(100), QUERIES)).astype(np.float32)
    with tempfile.TemporaryDirectory() as folder:
        path = pathlib.Path(folder) / "p.glint"
        gn.pyramid(gn.synth("flakes", 1024)).save(path)
        of_c, ndf, out = batch_of_c(options.library, path), gn.open(path), np.empty(QUERIES, dtype=np.float32)
        of_c(uv, h, sigma, out)
        assert np.array_equal(out, ndf.density(uv, h, sigma=sigma, threads=1))
        c, python = [], []
        for _ in range(ROUNDS):
            c.append(seconds(lambda: of_c(uv, h, sigma, out)))
            python.append(seconds(lambda: ndf.density(uv, h, sigma=sigma, threads=1)))
    ratio = statistics.median(p / q for p, q in zip(python, c))
    print(
        f"C {statistics.median(c):.3f} s, Python {statistics.median(python):.3f} s, ratio {ratio:.3f} for {QUERIES} densities"
    )


if __name__ == "__main__":
    main()
