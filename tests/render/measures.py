"""Numbers that compare a picture of a model with the picture of the Reference. Pictures are arrays [row][column], top row first."""

import numpy as np

try:
    import flip_evaluator
except ImportError:
    flip_evaluator = None

# Width of a block of an NDF image of 256 pixels, disk units.
BLOCK = 16 * 2 / 256
# Neighbouring pixels whose half vectors are further apart see too little of a block to show its border. Disk units.
SLOWEST_TURN = 0.01
# Pixels on either side of a border that are its surroundings.
SURROUNDINGS = 3


def rms(values):
    """Root mean square; 0 of nothing."""
    return float(np.sqrt(np.mean(np.square(values, dtype=np.float64)))) if np.size(values) else 0.0


def relative_rmse(image, truth, covered):
    """RMS of the difference over RMS of the truth, over the pixels that see a surface."""
    return rms((image - truth)[covered]) / rms(truth[covered])


def energy(image, truth):
    """Light of all pixels over that of the truth, minus 1."""
    return float(image.sum(dtype=np.float64) / truth.sum(dtype=np.float64) - 1)


def second_difference(frames):
    """RMS over pixels of the change of the change between three frames of a steady move."""
    before, now, after = frames
    return rms(before - 2 * now + after)


def flicker(frames, truth):
    """Second difference of three frames over that of the truth's frames."""
    return second_difference(frames) / second_difference(truth)


def change(smaller, larger):
    """RMS of the difference of two pictures whose footprints differ a little, over RMS of their mean."""
    return rms(larger - smaller) / rms(0.5 * (larger + smaller))


def border_steps(error, half):
    """Steps of the error between neighbouring pixels: (sums across each side of a block over the root of their number, those near it).

    The first are as large as the second where steps are noise, and larger where steps along a side agree, which the eye sees as a line.
    @param error  image - truth as a screen shows them, [row][column]
    @param half   half vectors, [row][column][2]
    """
    across, near = [], []
    blocks = np.floor(half / BLOCK)
    for axis in (0, 1):  # rows cross borders of half.y, columns those of half.x
        steps = np.diff(error, axis=axis)
        turn = np.linalg.norm(np.diff(half, axis=axis), axis=2)
        valid = (turn > 0) & (turn < SLOWEST_TURN)  # outside the surfaces all half vectors are 0
        crosses = np.diff(blocks[:, :, 1 - axis], axis=axis) != 0
        beside = np.zeros_like(crosses)
        for shift in range(1, SURROUNDINGS + 1):
            beside |= np.roll(crosses, shift, axis) | np.roll(crosses, -shift, axis)
        near.append(steps[beside & ~crosses & valid])
        side = blocks[:-1] if axis == 0 else blocks[:, :-1]
        _, which = np.unique(side[crosses & valid], axis=0, return_inverse=True)
        which = np.reshape(which, -1)
        across.append(np.bincount(which, steps[crosses & valid]) / np.sqrt(np.bincount(which)))
    return np.concatenate(across), np.concatenate(near)


def shown(image, exposure):
    """As a screen shows radiance, 0 to 1."""
    return (1 - np.exp(-exposure * np.maximum(image, 0))) ** (1 / 2.2)


def flip(image, truth, exposure):
    """Mean FLIP error of the pictures as a screen shows them; None where flip-evaluator is not installed."""
    if flip_evaluator is None:
        return None
    colours = [np.repeat(shown(picture, exposure)[:, :, None], 3, axis=2).astype(np.float32) for picture in (truth, image)]
    return float(flip_evaluator.evaluate(*colours, "LDR")[1])
