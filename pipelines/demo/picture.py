"""A grid of NDF images: one row for each model, one column for each footprint."""

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np

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


def draw(images, columns, path):
    """
    @param images   title of a row -> image for each column, top row first; the first row is the truth
    @param columns  title of each column
    """
    truth = next(iter(images.values()))
    margin, reach = crop(truth)
    size = truth[0].shape[0]
    figure, axes = plt.subplots(len(images), len(columns), squeeze=False,
                                figsize=(CELL_INCHES * len(columns) + 1.35, CELL_INCHES * len(images) + 0.5))
    for r, (title, row) in enumerate(images.items()):
        for c, image in enumerate(row):
            axis = axes[r, c]
            # One scale for a column, so that its rows can be compared.
            axis.imshow(np.log1p(image[margin : size - margin, margin : size - margin]), cmap="inferno", vmin=0,
                        vmax=np.log1p(truth[c].max()), extent=(-reach, reach, -reach, reach), interpolation="nearest")
            axis.set_xticks([])
            axis.set_yticks([])
            for spine in axis.spines.values():
                spine.set_visible(False)
            if r == 0:
                axis.set_title(columns[c], fontsize=10)
            else:
                error = np.linalg.norm(image - truth[c]) / np.linalg.norm(truth[c])
                axis.text(0.97, 0.03, f"error {100 * error:.1f} %", transform=axis.transAxes, ha="right", va="bottom", fontsize=8,
                          color="white")
        axes[r, 0].set_ylabel(title, fontsize=10, rotation=0, ha="right", va="center", labelpad=8)
    figure.text(0.995, 0.004, f"half vectors within $\\pm${reach:.2f}; log(1 + density); error: relative L2 from the reference",
                ha="right", va="bottom", fontsize=7.5, color="0.35")
    figure.subplots_adjust(left=0.19, right=0.995, top=1 - 0.28 / figure.get_figheight(), bottom=0.25 / figure.get_figheight(), wspace=0.03,
                           hspace=0.03)
    figure.savefig(path, dpi=100, metadata={"Software": None}, pil_kwargs={"optimize": True})
