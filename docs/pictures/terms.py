"""Draws terms.png: the words of GLOSSARY.md on a sample map. Run it by hand: python3 docs/pictures/terms.py"""

import pathlib

import matplotlib

matplotlib.use("Agg")
import matplotlib.patches as patches
import matplotlib.pyplot as plt
import numpy as np
import PIL.Image

HERE = pathlib.Path(__file__).parent
MAP = HERE.parents[1] / "data-samples" / "flakes_256.png"
RESOLUTION, BLOCK, STRIDE, SIGMA_R = 256, 16, 32, 0.012
FOOTPRINT_PER_STRIDE = 1.5 / 12**0.5
CENTRE = np.array([112.0, 144.0])  # texels: the centre of an image of level 0
HALF_VECTOR = (0.1, -0.14)
RANGE = (-0.2, 0.03, 0.15, 0.13)  # x, y, width, height
SHOWN_BLOCKS = 5  # of an NDF image, on either side of the pole
MARKED = 1  # column and row of the marked block, from the pole on
LEVELS = 4
COLUMNS = 3
SHOWN_SLICES = 3


def normals():
    """[height][width][2], bottom row first."""
    codes = np.asarray(PIL.Image.open(MAP).convert("RGB"), float)[::-1, :, :2]
    return codes / 127.5 - 1


def ndf_image(texels, centre, sigma):
    """Density of a Gaussian footprint, bottom row first: the sum over all texels of weight times lobe."""
    size = texels.shape[0]
    ticks = np.arange(size) + 0.5
    weight = [np.exp(-0.5 * (((ticks - c + size / 2) % size - size / 2) / sigma) ** 2) for c in centre]
    weights = weight[1][:, None] * weight[0][None, :]
    edges = np.linspace(-1, 1, RESOLUTION + 1)
    hit, _, _ = np.histogram2d(texels[..., 1].ravel(), texels[..., 0].ravel(), (edges, edges), weights=weights.ravel())
    frequency = np.fft.fftfreq(RESOLUTION, 2 / RESOLUTION)
    lobe = np.exp(-2 * (np.pi * SIGMA_R * frequency) ** 2)
    blurred = np.fft.ifft2(np.fft.fft2(hit) * lobe[:, None] * lobe[None, :]).real
    return np.maximum(blurred, 0) / blurred.sum() * (RESOLUTION / 2) ** 2


def bare(axis):
    axis.set_xticks([])
    axis.set_yticks([])
    axis.spines[:].set_visible(False)


def pointed(axis, text, at, where, colour="black", **options):
    axis.annotate(
        text,
        at,
        where,
        color=colour,
        fontsize=10,
        ha="center",
        va="center",
        arrowprops={"arrowstyle": "-", "color": colour, "linewidth": 0.8},
        **options,
    )


def draw_map(axis, texels, sigma):
    """The map as its image, with the centres of level 0 and one footprint."""
    size = texels.shape[0]
    z = np.sqrt(np.maximum(0, 1 - (texels**2).sum(-1)))
    axis.imshow(np.dstack([texels / 2 + 0.5, z / 2 + 0.5]), origin="lower", extent=(0, size, 0, size), interpolation="nearest")
    ticks = (np.arange(size // STRIDE) + 0.5) * STRIDE
    axis.plot(*(g.ravel() for g in np.meshgrid(ticks, ticks)), "k.", markersize=4)
    for deviations in (1, 2):
        axis.add_patch(
            patches.Circle(CENTRE, deviations * sigma, fill=False, linewidth=1.6, linestyle="-" if deviations == 1 else ":")
        )
    axis.plot([208, 240], [16, 16], "k-", linewidth=2)
    axis.text(224, 19, "stride", ha="center", va="bottom", fontsize=9)
    bare(axis)
    axis.set_title("a map, and a footprint on it", fontsize=11)
    axis.set_xlabel("solid: one deviation, dotted: two;\ndots: centres of the images of level 0", fontsize=9)


def draw_ndf(axis, image):
    """The NDF image of the footprint with its blocks, one half vector and one range."""
    axis.imshow(np.log1p(image), origin="lower", extent=(-1, 1, -1, 1), cmap="inferno", interpolation="nearest")
    side = 2 * BLOCK / RESOLUTION
    reach = SHOWN_BLOCKS * side
    for k in range(-SHOWN_BLOCKS, SHOWN_BLOCKS + 1):
        axis.axhline(k * side, color="white", linewidth=0.25)
        axis.axvline(k * side, color="white", linewidth=0.25)
    axis.add_patch(patches.Rectangle((MARKED * side, MARKED * side), side, side, fill=False, color="cyan", linewidth=1.6))
    axis.add_patch(patches.Rectangle(RANGE[:2], *RANGE[2:], fill=False, color="lime", linewidth=1.6))
    axis.plot(*HALF_VECTOR, "o", color="white", markersize=5)
    axis.set_xlim(-reach, reach)
    axis.set_ylim(-reach, reach)
    pointed(axis, "block", ((MARKED + 0.5) * side, (MARKED + 1) * side), (0.42, 0.47), "cyan")
    pointed(axis, "range", (RANGE[0] + 0.05, RANGE[1] + RANGE[3]), (-0.42, 0.47), "lime")
    pointed(axis, "half vector", HALF_VECTOR, (0.38, -0.5), "white")
    bare(axis)
    axis.set_title("its NDF image", fontsize=11)
    axis.set_xlabel("pixels are directions of normals,\nbrightness is the density", fontsize=9)


def draw_levels(axis):
    """Squares with a point for each image; a level has a quarter of the images of the one below."""
    for level in range(LEVELS):
        count = 2 ** (LEVELS - 1 - level)
        base = level * 0.92
        corner = lambda x, y: (x + 0.45 * y, base + 0.45 * y)
        axis.add_patch(
            patches.Polygon([corner(0, 0), corner(1, 0), corner(1, 1), corner(0, 1)], facecolor="0.92", edgecolor="0.4")
        )
        for j in range(count):
            for i in range(count):
                axis.plot(*corner((i + 0.5) / count, (j + 0.5) / count), "k.", markersize=3 + 2.5 * level)
        name = f"level {level}\n{count} x {count} images" if level < LEVELS - 1 else "the mean\nof the map"
        axis.text(1.52, base + 0.22, name, fontsize=10, va="center")
    axis.set_xlim(-0.1, 2.5)
    axis.set_ylim(-0.1, LEVELS * 0.92 - 0.3)
    axis.set_aspect("equal")
    bare(axis)
    axis.set_title("the levels of a pyramid", fontsize=11)
    axis.set_xlabel("twice the stride, twice the footprint\nfrom level to level", fontsize=9)


def draw_cluster(axes, slices):
    """Slices of one cluster, and the one that has most of every basis image as their sum."""
    _, _, basis = np.linalg.svd(slices, full_matrices=False)
    shown = (0, 1, int(np.argmax(np.abs(slices @ basis[:COLUMNS].T).min(axis=1))))
    square = lambda values: values.reshape(BLOCK, BLOCK)
    for axis, k in zip(axes, shown):
        axis.imshow(np.log1p(square(slices[k])), origin="lower", cmap="inferno", vmin=0, vmax=np.log1p(slices.max()))
        axis.set_title(f"slice {k}", fontsize=10)
        bare(axis)
    axes[len(shown)].axis("off")
    axes[len(shown)].text(0.5, 0.5, f"slice {shown[-1]}  ≈", ha="center", va="center", fontsize=13)
    for k, axis in enumerate(axes[len(shown) + 1 :]):
        coefficient = float(slices[shown[-1]] @ basis[k])
        peak = np.abs(basis[k]).max()
        axis.imshow(np.sign(coefficient) * square(basis[k]), origin="lower", cmap="RdBu_r", vmin=-peak, vmax=peak)
        axis.set_title(f"{abs(coefficient):.0f} x column {k}", fontsize=10)
        axis.text(-0.2 if k else 1, 0.5, "+" if k else "", transform=axis.transAxes, ha="center", va="center", fontsize=14)
        bare(axis)


def main():
    texels = normals()
    sigma = FOOTPRINT_PER_STRIDE * STRIDE
    ticks = (np.arange(texels.shape[0] // STRIDE) + 0.5) * STRIDE
    images = {(x, y): ndf_image(texels, (x, y), sigma) for y in ticks for x in ticks}
    place = (RESOLUTION // BLOCK // 2 + MARKED) * BLOCK
    stack = [image[place : place + BLOCK, place : place + BLOCK].ravel() for image in images.values()]
    slices = np.array([values for values in stack if values.any()])

    figure = plt.figure(figsize=(11, 6.4), dpi=100)
    top = figure.add_gridspec(1, 3, left=0.02, right=0.99, top=0.95, bottom=0.39, wspace=0.05)
    draw_map(figure.add_subplot(top[0]), texels, sigma)
    draw_ndf(figure.add_subplot(top[1]), images[tuple(CENTRE)])
    draw_levels(figure.add_subplot(top[2]))
    bottom = figure.add_gridspec(1, SHOWN_SLICES + 1 + COLUMNS, left=0.02, right=0.98, top=0.215, bottom=0.035, wspace=0.35)
    draw_cluster([figure.add_subplot(cell) for cell in bottom], slices)
    figure.text(
        0.02,
        0.265,
        "a cluster: the same block (here the cyan one) of every image of a region. Each such block is a slice. Compression "
        "keeps a few basis images of\nthe cluster, and for each slice one coefficient a column: a slice is then the sum of coefficient "
        "times basis image.",
        fontsize=9,
    )
    path = HERE / "terms.png"
    figure.savefig(path)
    PIL.Image.open(path).convert("RGB").save(path, optimize=True)


if __name__ == "__main__":
    main()
