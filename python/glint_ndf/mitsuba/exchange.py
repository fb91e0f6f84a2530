"""Numbers between Dr.Jit and numpy: one row a lane. Scalar variants have one lane."""

import drjit as dr
import mitsuba as mi
import numpy as np


def is_jit():
    return dr.is_jit_v(mi.Float)


def to_rows(*vectors):
    """Vectors of a variant as float32 arrays [lanes, components]; all have the same number of lanes."""
    if not is_jit():
        return [np.array([list(v)], dtype=np.float32) for v in vectors]
    vectors = [dr.detach(v) for v in vectors]
    dr.eval(*vectors)
    lanes = max(dr.width(v) for v in vectors)
    # The transposed array has a stride of one component, which the library reads without a copy.
    return [np.broadcast_to(v.numpy(), (len(v), lanes)).T for v in vectors]


def to_mask(mask, lanes):
    """A mask of a variant as a bool array [lanes]."""
    if not is_jit():
        return np.array([bool(mask)])
    mask = mi.Bool(mask)
    dr.eval(mask)
    return np.broadcast_to(mask.numpy().astype(bool), (lanes,))


def to_float(column):
    """An array [lanes] as a Float of the variant."""
    if not is_jit():
        return float(column[0])
    return mi.Float(np.ascontiguousarray(column, dtype=np.float32))


def to_vector(rows):
    """An array [lanes, 3] as a Vector3f of the variant."""
    return mi.Vector3f(*(to_float(rows[:, k]) for k in range(3)))


def lanes_of(mask):
    """Indices of the lanes in a mask, or None if these are all."""
    return None if mask.all() else np.flatnonzero(mask)


def take(lanes, *arrays):
    """The rows `lanes` of arrays; the arrays themselves where `lanes` is None."""
    return arrays if lanes is None else tuple(a[lanes] for a in arrays)


def spread(lanes, count, array):
    """The inverse of `take`: an array of `count` rows, 0 where a row was not taken."""
    if lanes is None:
        return array
    whole = np.zeros((count,) + array.shape[1:], dtype=array.dtype)
    whole[lanes] = array
    return whole
