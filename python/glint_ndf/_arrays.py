"""Arrays of queries: leading dimensions that broadcast, flat for the extension module, and shaped again."""

from __future__ import annotations

from typing import Sequence

import numpy as np

from . import _glint
from .errors import ArgumentError


def members(value, count: int, name: str, dtype=np.float32) -> np.ndarray:
    """`value` as an array whose last dimension has `count` members; 1: the last dimension is added.

    Arrays of `dtype` are not copied.
    """
    try:
        array = np.require(value, dtype=dtype, requirements="A")
    except (TypeError, ValueError) as error:
        raise ArgumentError(f"{name}: {error}") from error
    if count == 1:
        return array[..., np.newaxis]
    if array.ndim == 0 or array.shape[-1] != count:
        raise ArgumentError(f"{name}: the last dimension must be {count}, and the shape is {array.shape}")
    return array


class Batch:
    """Queries of one call: the common leading shape of all their arrays."""

    def __init__(self, *arrays: np.ndarray):
        try:
            self.shape = np.broadcast_shapes(*(a.shape[:-1] for a in arrays))
        except ValueError:
            shapes = ", ".join(str(a.shape) for a in arrays)
            raise ArgumentError(f"the leading dimensions do not broadcast: {shapes}") from None
        self.count = int(np.prod(self.shape, dtype=np.int64))

    def rows(self, array: np.ndarray | None) -> np.ndarray | None:
        """[queries][members]: a view of the array where its memory allows."""
        if array is None:
            return None
        return np.broadcast_to(array, self.shape + array.shape[-1:]).reshape(self.count, array.shape[-1])

    def answers(self, count: int = 1) -> np.ndarray:
        """Memory for `count` numbers a query."""
        return np.empty((self.count, count), dtype=np.float32)

    def shaped(self, answers: np.ndarray) -> np.ndarray:
        """Answers in the shape of the queries: one number a query has no last dimension."""
        return answers.reshape(self.shape if answers.shape[1] == 1 else self.shape + answers.shape[1:])


class FootprintArrays:
    """Centres and sizes of footprints, as the user gave them."""

    def __init__(self, uv, sigma, covariance, box, spread=None, keep_whole_parts: bool = False):
        given = [name for name, v in (("sigma", sigma), ("covariance", covariance), ("box", box)) if v is not None]
        if len(given) != 1:
            raise ArgumentError(f"give one of sigma, covariance and box; given: {', '.join(given) or 'none'}")
        uv = np.asarray(uv)
        self.precise = uv.dtype == np.float64 and not keep_whole_parts
        self.uv = members(uv, 2, "uv", np.float64 if self.precise else np.float32)
        self.sigma = None if sigma is None else members(sigma, 1, "sigma")
        self.covariance = None if covariance is None else members(covariance, 3, "covariance")
        self.box = None if box is None else _half_axes(box)
        self.spread = None if spread is None else members(spread, 2, "spread")

    def arrays(self) -> Sequence[np.ndarray]:
        return [a for a in (self.uv, self.sigma, self.covariance, self.box, self.spread) if a is not None]

    def of(self, batch: Batch) -> _glint.Footprints:
        uv = batch.rows(self.uv)
        return _glint.Footprints(
            None if self.precise else uv,
            uv if self.precise else None,
            batch.rows(self.sigma),
            batch.rows(self.covariance),
            batch.rows(self.box),
            batch.rows(self.spread),
        )


def _half_axes(box) -> np.ndarray:
    """[..., 2, 2] half axes as [..., 4]."""
    array = np.asarray(box, dtype=np.float32)
    if array.shape[-2:] != (2, 2):
        raise ArgumentError(f"box: the last dimensions must be 2, 2 (two half axes), and the shape is {array.shape}")
    return array.reshape(array.shape[:-2] + (4,))
