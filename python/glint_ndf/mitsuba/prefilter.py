"""Light of the environment on glints without sampling it: one spherical Gaussian of the environment is picked, and the density of
normals is averaged over its half vectors (Deng 2022, section 5.4).
"""

import drjit as dr
import mitsuba as mi
import numpy as np

from .exchange import is_jit
from .lobes import fit, grid
from .spectra import light_of

#: Part of the picks that follows the power of the lobes alone, whatever the view.
_SHARE_OF_POWER = 0.1

#: nm.
_VISIBLE = (360.0, 830.0)


class Prefilter:
    """Lobes of the environment of a scene, and the materials that they light."""

    def __init__(self, scene, count):
        self.environment = scene.environment()
        self.lobes = fit(*_seen(self.environment), count)
        self.materials = _materials(scene)

    @staticmethod
    def of(scene, count):
        """None where there is nothing to do: no environment, or no material that can be prefiltered."""
        if count == 0 or scene.environment() is None:
            return None
        made = Prefilter(scene, count)
        return made if made.materials else None

    def light(self, scene, si, sampler, active):
        """Radiance of the environment that a hit reflects towards its viewer, and the lanes that have been answered: those with a
        glint material without layers. They must not count the environment again.
        """
        answered, radiance = mi.Bool(False), mi.Spectrum(0)
        xi, around = sampler.next_1d(active), sampler.next_2d(active)
        bsdf = si.bsdf()
        for material in self.materials:
            here = active & (bsdf == mi.BSDFPtr(material)) if is_jit() else active and bsdf is material
            if not dr.any(here):
                continue
            answered = answered | here
            radiance = radiance + self._of_material(scene, si, material.layers, xi, around, here)
        return radiance, answered

    def is_sky(self, emitter):
        """Whether an emitter is the environment."""
        return emitter == mi.EmitterPtr(self.environment) if is_jit() else emitter is self.environment

    def _of_material(self, scene, si, layers, xi, around, active):
        pick, probability = self._pick(si, layers.facets.slope_variance, xi)
        lobes = self.lobes
        axis = mi.Vector3f(*(_at(lobes.axes[:, k], pick) for k in range(3)))
        sharpness = _at(lobes.sharpness, pick)
        towards = si.to_local(axis)
        f = layers.facets.lit_by_lobe(si, si.wi, towards, sharpness, active)
        # The half vector of the axis stands for those of the lobe.
        upwards = mi.Vector3f(towards.x, towards.y, dr.maximum(towards.z, 1e-3))
        f = f * layers.reflectance(si, si.wi, dr.normalize(upwards), active)
        rgb = [_at(lobes.amplitudes[:, c], pick) / probability for c in range(3)]
        # One direction says whether the lobe is hidden. Directions below the surface are folded above it: they must not count as free.
        direction = _around(axis, sharpness, around)
        direction = direction - 2 * dr.minimum(dr.dot(direction, si.n), 0) * si.n
        hidden = scene.ray_test(si.spawn_ray(direction), active)
        return dr.select(active & (hidden ^ True), f * light_of(rgb, si.wavelengths), 0)

    def _pick(self, si, slope_variance, xi):
        """One lobe at random: by its power, and by how far its axis is from the mirrored view, relative to the width of the lobe and
        of the reflection. Returns its index and probability.
        """
        mirrored = si.to_world(mi.Vector3f(-si.wi.x, -si.wi.y, si.wi.z))
        power = self.lobes.power()
        total, weights = mi.Float(0), []
        for axis, sharpness, strength in zip(self.lobes.axes, self.lobes.sharpness, power):
            width = float(1 / (4 * slope_variance + 1 / sharpness))
            near = dr.exp(width * (dr.dot(mirrored, mi.Vector3f(*axis.tolist())) - 1))
            weights.append(float(strength) * (_SHARE_OF_POWER + (1 - _SHARE_OF_POWER) * near))
            total = total + weights[-1]
        left, before = xi * total, mi.Float(0)
        pick, chosen = mi.UInt32(0), weights[0]
        for k, weight in enumerate(weights):
            # The last lobe whose predecessors add up to at most `left`.
            reached = left >= before
            pick, chosen = dr.select(reached, mi.UInt32(k), pick), dr.select(reached, weight, chosen)
            before = before + weight
        return pick, chosen / total


def _at(values, index):
    """Entry `index` of an array of numpy."""
    if not is_jit():
        return float(values[int(index)])
    return dr.gather(mi.Float, mi.Float(np.ascontiguousarray(values, dtype=np.float32)), index)


def _around(axis, sharpness, xi):
    """A direction of the von Mises-Fisher density around an axis."""
    cosine = 1 + dr.log(dr.maximum(xi.x + (1 - xi.x) * dr.exp(-2 * sharpness), 1e-30)) / sharpness
    sine, angle = dr.sqrt(dr.maximum(1 - cosine * cosine, 0)), 2 * dr.pi * xi.y
    return mi.Frame3f(axis).to_world(mi.Vector3f(sine * dr.cos(angle), sine * dr.sin(angle), cosine))


def _seen(environment):
    """Radiance [n, 3] of an environment in linear sRGB from directions [n, 3], and their solid angles [n]."""
    directions, solid = grid()
    flat = directions.reshape(-1, 3).astype(np.float32)
    if is_jit():
        rgb = _radiance(environment, mi.Vector3f(*flat.T)).reshape(3, -1).T
    else:
        rgb = np.array([_radiance(environment, mi.Vector3f(*d.tolist())).ravel() for d in flat])
    return np.maximum(rgb, 0).astype(np.float64), flat.astype(np.float64), solid.ravel()


def _radiance(environment, direction):
    si = dr.zeros(mi.SurfaceInteraction3f, dr.width(direction))
    si.wi = -direction
    if not mi.is_spectral:
        return np.array(environment.eval(si))
    # Red, green and blue of a spectrum, by wavelengths that are spread evenly over the visible range.
    total, passes, (low, high) = 0, 16, _VISIBLE
    for k in range(passes):
        si.wavelengths = mi.Spectrum(*(low + (high - low) * (k + j / 4) / passes for j in range(4)))
        total = total + np.array(mi.spectrum_to_srgb(environment.eval(si) * (high - low), si.wavelengths))
    return total / passes


def _materials(scene):
    """The BSDFs of a scene that reflect by an NDF alone."""
    found = []
    for shape in scene.shapes():
        bsdf = shape.bsdf()
        layers = getattr(bsdf, "layers", None)
        if layers is not None and layers.coat is None and layers.base is None and layers.facets.slope_variance is not None:
            if not any(bsdf is other for other in found):
                found.append(bsdf)
    return found
