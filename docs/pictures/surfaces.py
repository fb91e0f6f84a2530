"""Draws surfaces.png: the kinds of glint-synth, each as it is lit, with the distribution of its normals. Needs the tools: python3 docs/pictures/surfaces.py build/bin"""

import pathlib
import subprocess
import sys
import tempfile

import h5py
import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np

HERE = pathlib.Path(__file__).parent
KINDS = [
    "isotropic",
    "anisotropic",
    "brushed",
    "flakes",
    "scratches",
    "leather",
    "bumps",
    "scales",
    "relief",
    "structured",
    "wood",
    "weave",
    "twill",
    "silk",
    "sawtooth",
    "grating",
    "flake2d",
    "flat",
]
SIZE, COLUMNS = 256, 6
LIGHT = np.array([-0.35, 0.55, 0.76])
BINS, WIDEST = 96, 0.8  # of the distribution: bins, and the largest component shown


def normals(bin, kind, folder):
    """[height][width][3], bottom row first."""
    image, asset = folder / f"{kind}.exr", folder / f"{kind}.glint"
    subprocess.run([bin / "glint-synth", kind, "-o", image, "--size", str(SIZE), "--seed", "3"], check=True)
    subprocess.run([bin / "glint-ingest", image, "-o", asset, "--allow-constant", "--quiet"], check=True)
    with h5py.File(asset) as file:
        xy = file["normals"][...]
    return np.concatenate([xy, np.sqrt(np.maximum(0, 1 - (xy**2).sum(-1, keepdims=True)))], -1)


def main():
    bin = pathlib.Path(sys.argv[1] if len(sys.argv) > 1 else "build/bin")
    rows = -(-len(KINDS) // COLUMNS)
    figure, axes = plt.subplots(
        2 * rows, COLUMNS, figsize=(2 * COLUMNS, 4 * rows), gridspec_kw={"hspace": 0.03, "wspace": 0.03}
    )
    with tempfile.TemporaryDirectory() as folder:
        for k, kind in enumerate(KINDS):
            n = normals(bin, kind, pathlib.Path(folder))
            lit, ndf = axes[2 * (k // COLUMNS)][k % COLUMNS], axes[2 * (k // COLUMNS) + 1][k % COLUMNS]
            lit.imshow(np.clip(n @ LIGHT, 0, 1), cmap="gray", origin="lower", vmin=0.2, vmax=1)
            lit.text(6, SIZE - 8, kind, fontsize=9, va="top", bbox={"facecolor": "white", "edgecolor": "none", "pad": 1.5})
            counts, _, _ = np.histogram2d(n[..., 1].ravel(), n[..., 0].ravel(), bins=BINS, range=[[-WIDEST, WIDEST]] * 2)
            ndf.imshow(np.log1p(counts), cmap="inferno", origin="lower")
    for axis in axes.flat:
        axis.axis("off")
    figure.savefig(HERE / "surfaces.png", dpi=72, bbox_inches="tight", pad_inches=0.05)


if __name__ == "__main__":
    main()
