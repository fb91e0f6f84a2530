"""Whether the shapes that carry a glint material have texture coordinates."""

import drjit as dr
import mitsuba as mi
import numpy as np

from .errors import PluginError


class UvCheck:
    """Raises an error for meshes without texture coordinates: Mitsuba gives their points barycentric coordinates instead, in which
    each triangle shows the whole map. Each shape is looked at once.
    """

    def __init__(self, plugin, path):
        self.plugin, self.path = plugin, path
        self._seen = {0}

    def of(self, si):
        """Checks the shapes of surface interactions. Interactions without a shape, which tests make, pass."""
        if not dr.is_jit_v(mi.Float):
            shape = si.shape
            if shape is not None and id(shape) not in self._seen:
                self._seen.add(id(shape))
                self._check(shape)
            return
        index = dr.reinterpret_array(mi.UInt32, si.shape)
        dr.eval(index)
        present = np.flatnonzero(np.bincount(index.numpy()))
        for number in present.tolist():
            if number not in self._seen:
                self._seen.add(number)
                self._check(dr.reinterpret_array(mi.ShapePtr, mi.UInt32(number))[0])

    def _check(self, shape):
        if shape.is_mesh() and not _has_uv(shape):
            raise PluginError(
                self.plugin,
                f"the mesh '{shape.id()}' has no texture coordinates (uv), by which the map is placed; give it some, such as by a"
                " uv unwrap in the program that made it",
                self.path,
            )


def _has_uv(mesh):
    # By its parameters: interactions give the shape as a plain Shape, which does not have the members of a Mesh. Meshes that
    # Mitsuba makes itself (rectangle, cube) show no vertices, and have coordinates.
    parameters = mi.traverse(mesh)
    return "vertex_positions" not in parameters or len(parameters.get("vertex_texcoords", ())) > 0
