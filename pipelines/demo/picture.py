"""A grid of NDF images: one row for each model, one column for each footprint."""

import io

import matplotlib

matplotlib.use("Agg")
import matplotlib.patheffects as patheffects
import matplotlib.pyplot as plt
import numpy as np
import PIL.Image

CELL_INCHES = 1.95
KEPT_MASS = 0.97


def crop(images):
    """Margin in pixels, and half width in disk units, of the square round the pole that holds nearly all of the images."""
    total = np.sum([image / image.sum() for image in images], axis=0) / len(images)
    n = total.shape[0]
    for margin in range(n // 2 - 4, 0, -1):
        if total[margin : n - margin, margin : n - margin].sum() >= KEPT_MASS:
            return margin, 1 - 2 * margin / n
    return 0, 1.0


def relative(image, truth):
    """Relative L2 distance."""
    return float(np.linalg.norm(image - truth) / np.linalg.norm(truth))


def show(axis, image, truth, margin, note=""):
    """An image without its margin, in the colours of the truth's densities."""
    size = truth.shape[0]
    axis.imshow(
        np.log1p(image[margin : size - margin, margin : size - margin]),
        cmap="inferno",
        vmin=0,
        vmax=np.log1p(truth.max()),
        interpolation="nearest",
    )
    axis.set_xticks([])
    axis.set_yticks([])
    axis.spines[:].set_visible(False)
    axis.text(
        0.97,
        0.03,
        note,
        transform=axis.transAxes,
        ha="right",
        va="bottom",
        fontsize=8,
        color="white",
        linespacing=1.3,
        path_effects=[patheffects.withStroke(linewidth=2, foreground="black")],
    )


def grid(rows, columns, left=0.2):
    """Axes of a grid of images, titles of rows at the left and of columns above."""
    figure, axes = plt.subplots(
        len(rows), len(columns), squeeze=False, figsize=(CELL_INCHES * len(columns) + 1.35, CELL_INCHES * len(rows) + 0.5)
    )
    for c, title in enumerate(columns):
        axes[0, c].set_title(title, fontsize=10)
    for r, title in enumerate(rows):
        axes[r, 0].set_ylabel(title, fontsize=10, rotation=0, ha="right", va="center", labelpad=8)
    figure.subplots_adjust(
        left=left,
        right=0.995,
        top=1 - 0.28 / figure.get_figheight(),
        bottom=0.25 / figure.get_figheight(),
        wspace=0.03,
        hspace=0.03,
    )
    return figure, axes


def save(figure, note, path):
    figure.text(0.995, 0.004, note, ha="right", va="bottom", fontsize=7.5, color="0.35")
    # 256 colours are enough for one colour map, and a third of the bytes.
    pixels = io.BytesIO()
    figure.savefig(pixels, dpi=100)
    plt.close(figure)
    PIL.Image.open(pixels).convert("RGB").quantize(256).save(path, optimize=True)


def draw_footprints(images, columns, path):
    """One map: a row for each model, a column for each footprint.

    @param images   title of a row -> image for each column, top row first; the first row is the truth
    @param columns  title of each column
    """
    truth = next(iter(images.values()))
    margin, reach = crop(truth)
    figure, axes = grid(list(images), columns)
    for r, row in enumerate(images.values()):
        for c, image in enumerate(row):
            # One scale for a column, so that its rows can be compared.
            show(axes[r, c], image, truth[c], margin, f"error {100 * relative(image, truth[c]):.1f} %" if r else "")
    save(figure, f"half vectors within $\\pm${reach:.2f}; log(1 + density); error: relative L2 from the reference", path)


def draw_models(maps, path):
    """One footprint: a row for each map, a column for each model.

    @param maps  title of a row -> groups of {title of a column: (image, note)}; the first column of a group is the truth of the others
    """
    titles = [title for group in next(iter(maps.values())) for title in group]
    figure, axes = grid(list(maps), titles, left=0.075)
    for r, groups in enumerate(maps.values()):
        margin, _ = crop([next(iter(groups[0].values()))[0]])
        columns = iter(axes[r])
        for group in groups:
            truth = next(iter(group.values()))[0]
            for c, (image, note) in enumerate(group.values()):
                show(next(columns), image, truth, margin, f"error {100 * relative(image, truth):.1f} %\n{note}" if c else note)
    save(
        figure,
        "log(1 + density) over half vectors inside one Gaussian footprint, or inside the box of its second moments; "
        "error: relative L2 from the reference of the same footprint; bytes of the file; time of a density query",
        path,
    )
