"""Environments as sums of spherical Gaussians (Deng 2022, section 5.4)."""

import numpy as np

#: Directions of a fit: rows and columns of a grid over the sphere. 2.8 degrees apart.
GRID = (64, 128)

_ITERATIONS = 60
#: Lobes are at most as narrow as a cell of the grid allows, and at least this wide.
_SHARPNESS_RANGE = (0.5, 1500.0)
_TINY = 1e-12

#: A mean of unit vectors that is shorter than this has no direction.
_NO_DIRECTION = 1e-6


class Lobes:
    """Light from each direction w: the sum of amplitudes exp(sharpness (w . axis - 1)) over all lobes.

    axes [lobes, 3] unit vectors, sharpness [lobes], amplitudes [lobes, 3] radiance in red, green and blue.
    """

    def __init__(self, axes, sharpness, amplitudes):
        self.axes, self.sharpness, self.amplitudes = axes, sharpness, amplitudes

    def __len__(self):
        return len(self.sharpness)

    def radiance(self, directions):
        """[..., 3] radiance from unit vectors [..., 3]."""
        return np.exp(self.sharpness * (directions @ self.axes.T - 1)) @ self.amplitudes

    def power(self):
        """[lobes] integral of each lobe over the sphere, mean of the channels."""
        return 2 * np.pi * -np.expm1(-2 * self.sharpness) / self.sharpness * self.amplitudes.mean(axis=-1)


def grid(rows=GRID[0], columns=GRID[1]):
    """Directions [rows, columns, 3] of a latitude-longitude grid with z up, and their solid angles [rows, columns]."""
    edges = np.cos(np.pi * np.arange(rows + 1) / rows)
    theta = np.pi * (np.arange(rows) + 0.5) / rows
    phi = 2 * np.pi * (np.arange(columns) + 0.5) / columns
    sine, cosine = np.sin(theta)[:, None], np.broadcast_to(np.cos(theta)[:, None], (rows, columns))
    directions = np.stack([sine * np.cos(phi), sine * np.sin(phi), cosine], axis=-1)
    solid = np.repeat((edges[:-1] - edges[1:])[:, None] * 2 * np.pi / columns, columns, axis=1)
    return directions, solid


def fit(radiance, directions, solid, count, seed=1):
    """Fits `count` lobes to radiance [n, 3] from directions [n, 3] that stand for solid angles [n].

    Axes and sharpness by expectation maximisation of a mixture of von Mises-Fisher densities, weighted by light; amplitudes then by
    least squares, none below 0. The same seed gives the same lobes.
    """
    weight = radiance.mean(axis=-1) * solid
    if not weight.sum() > 0:
        return Lobes(np.tile([0.0, 0, 1], (count, 1)), np.ones(count), np.zeros((count, 3)))
    weight = weight / weight.sum()
    axes, sharpness = _spread_over(directions, weight, count, seed), np.full(count, 2.0 * count)
    shares = np.full(count, 1 / count)
    for _ in range(_ITERATIONS):
        # Log density of each component, up to what all have in common.
        log_norm = np.log(sharpness) - np.log(-np.expm1(-2 * sharpness))
        logs = np.log(shares + _TINY) + log_norm + sharpness * (directions @ axes.T - 1)
        part = np.exp(logs - logs.max(axis=1, keepdims=True))
        part *= weight[:, None] / part.sum(axis=1, keepdims=True)
        shares = part.sum(axis=0)
        mean = part.T @ directions / (shares[:, None] + _TINY)
        length = np.linalg.norm(mean, axis=1)
        # Light that comes evenly from all sides has no mean direction: its lobe keeps its axis.
        axes = np.where(length[:, None] > _NO_DIRECTION, mean / np.maximum(length, _TINY)[:, None], axes)
        length = np.minimum(length, 1 - 1e-6)
        sharpness = np.clip(length * (3 - length**2) / (1 - length**2), *_SHARPNESS_RANGE)
    return Lobes(axes, sharpness, _amplitudes(radiance, directions, solid, axes, sharpness))


def _spread_over(directions, weight, count, seed):
    """First axes: far from each other, where the light is (k-means++)."""
    random = np.random.default_rng(seed)
    chosen = [random.choice(len(weight), p=weight)]
    distance = np.full(len(weight), 4.0)
    for _ in range(count - 1):
        distance = np.minimum(distance, 2 - 2 * directions @ directions[chosen[-1]])
        score = weight * np.maximum(distance, 0) + _TINY
        chosen.append(random.choice(len(weight), p=score / score.sum()))
    return directions[chosen].copy()


def _amplitudes(radiance, directions, solid, axes, sharpness):
    """Least squares over the sphere with amplitudes >= 0, by multiplicative steps, which never leave that range."""
    basis = np.exp(sharpness * (directions @ axes.T - 1))
    gram, right = basis.T @ (solid[:, None] * basis), basis.T @ (solid[:, None] * radiance)
    amplitudes = np.maximum(right, 0) / (np.diag(gram)[:, None] + _TINY) / len(sharpness) + _TINY
    for _ in range(2000):
        amplitudes *= np.maximum(right, 0) / (gram @ amplitudes + _TINY)
    # The whole power is kept: what lobes cannot show is spread over them.
    wanted, got = (solid[:, None] * radiance).sum(axis=0), solid @ (basis @ amplitudes)
    return amplitudes * (wanted / (got + _TINY))


def fit_lobes(bitmap, count=32, seed=1):
    """Fits lobes to an environment image.

    Args:
        bitmap: [rows][columns][3] linear radiance, or an `mi.Bitmap`, as Mitsuba's `envmap` takes it: the first row is up (+y).
        count: lobes.

    Returns:
        Lobes in the coordinates of the environment before its `to_world`.
    """
    image = np.array(bitmap, dtype=np.float64)
    if image.ndim != 3 or image.shape[2] < 3 or not np.isfinite(image).all():
        raise ValueError(f"bitmap: must be [rows][columns][3] finite numbers, and has the shape {image.shape}")
    if count < 1:
        raise ValueError(f"count: must be at least 1, and is {count}")
    rows, columns = image.shape[:2]
    directions, solid = grid(rows, columns)
    step = max(1, rows // GRID[0])
    image, directions, solid = _averaged(np.maximum(image[..., :3], 0), directions, solid, step)
    # Mitsuba's frame: y is up, u = atan2(x, -z) / (2 pi).
    s = directions[:, 2:3]
    x, y = directions[:, 0:1], directions[:, 1:2]
    return fit(image, np.concatenate([y, s, -x], axis=1), solid, count, seed)


def _averaged(image, directions, solid, step):
    """Mean radiance and direction of squares of `step` pixels, flattened."""
    rows, columns = image.shape[0] // step * step, image.shape[1] // step * step

    def sums(a):
        a = a[:rows, :columns].reshape(rows // step, step, columns // step, step, -1)
        return a.sum(axis=(1, 3)).reshape(-1, a.shape[-1])

    weight = solid[..., None]
    total = sums(weight)
    mean = sums(weight * directions)
    return sums(weight * image) / total, mean / np.linalg.norm(mean, axis=1, keepdims=True), total[:, 0]
