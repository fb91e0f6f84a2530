"""A clear dielectric layer over other layers: its reflection, and what light loses and how it bends on the way through."""

import drjit as dr
import mitsuba as mi
import numpy as np

#: Entries of the table of a rough coat's albedo, evenly spaced by the root of the cosine: the albedo of a smooth coat is steep at low
#: cosines. And points of its quadrature along each axis. Errors are below 0.002 in albedo for alpha of 0.003 and more
#: (tests/python/mitsuba/test_layers.py).
_TABLE_SIZE, _QUADRATURE = 128, 64


def fresnel(cosine, eta):
    """Reflectance of a smooth dielectric, seen from outside at this cosine."""
    return mi.fresnel(cosine, eta)[0]


class Coat:
    """A dielectric surface.

    Args:
        eta: index of refraction over that of air, above 1.
        alpha: Beckmann roughness; 0: smooth, a mirror.
        layer: GlintLayer of the coat's own normals, or None. Its albedo counts as that of a smooth surface.
    """

    def __init__(self, eta, alpha, layer=None):
        self.eta, self.alpha, self.layer = eta, alpha, layer
        self.smooth = alpha == 0 and layer is None
        table = _albedos(eta, alpha, np.linspace(0, 1, _TABLE_SIZE) ** 2) if alpha > 0 else None
        self.internal = _internal_reflectance(eta, table)
        self._table = mi.Float(table) if table is not None and dr.is_jit_v(mi.Float) else table

    def albedo(self, cosine):
        """Share of light from this cosine that the coat reflects at its surface."""
        if self._table is None:
            return fresnel(cosine, self.eta)
        position = dr.sqrt(dr.clip(cosine, 0, 1)) * (_TABLE_SIZE - 1)
        if not dr.is_jit_v(mi.Float):
            return float(np.interp(position, np.arange(_TABLE_SIZE), self._table))
        low = mi.UInt32(dr.minimum(position, _TABLE_SIZE - 2))
        part = position - mi.Float(low)
        return dr.lerp(dr.gather(mi.Float, self._table, low), dr.gather(mi.Float, self._table, low + 1), part)

    def evaluate(self, si, viewed, lit, active):
        """Reflection times the cosine of `lit`, and pdf, of a coat that is not smooth."""
        h = viewed + lit
        h = h * dr.rsqrt(dr.maximum(dr.squared_norm(h), 1e-12))
        reflectance = fresnel(dr.dot(viewed, h), self.eta)
        if self.layer is not None:
            f, pdf = self.layer.evaluate(si, viewed, lit, active)
            return f * reflectance * lit.z, pdf
        distribution = self._distribution()
        d = distribution.eval(h)
        valid = active & (viewed.z > 0) & (lit.z > 0) & (d > 0) & (dr.dot(lit, h) > 0)
        # Quotients are 0 where they are not valid; scalar variants would raise an error for a division by 0.
        value = reflectance * d * distribution.G(viewed, lit, h) / dr.select(valid, 4 * viewed.z, 1)
        pdf = distribution.pdf(viewed, h) / dr.select(valid, 4 * dr.dot(lit, h), 1)
        return dr.select(valid, value, 0), dr.select(valid, pdf, 0)

    def sample(self, si, viewed, xi, active):
        """A direction by the lobe of the coat; z is 0 or less where nothing was drawn."""
        if self.smooth:
            return mi.Vector3f(-viewed.x, -viewed.y, viewed.z)
        if self.layer is not None:
            lit, _, pdf = self.layer.sample(si, viewed, xi, active)
            return dr.select(pdf > 0, lit, mi.Vector3f(0, 0, 0))
        h, _ = self._distribution().sample(viewed, xi)
        return mi.reflect(viewed, h)

    def _distribution(self):
        return mi.MicrofacetDistribution(mi.MicrofacetType.Beckmann, self.alpha, True)

    def inside(self, v):
        """The direction below the surface of a direction above it."""
        x, y = v.x / self.eta, v.y / self.eta
        return mi.Vector3f(x, y, dr.sqrt(dr.maximum(1 - x * x - y * y, 0)))

    def outside(self, v):
        """The inverse of `inside`; z is 0 where the light is reflected back totally."""
        x, y = v.x * self.eta, v.y * self.eta
        return mi.Vector3f(x, y, dr.safe_sqrt(1 - x * x - y * y))


def _dielectric(cosine, eta):
    """Fresnel reflectance in numpy, from the side of index 1."""
    inner = np.sqrt(1 - (1 - cosine**2) / eta**2)
    s, p = (cosine - eta * inner) / (cosine + eta * inner), (inner - eta * cosine) / (inner + eta * cosine)
    return 0.5 * (s * s + p * p)


def _internal_reflectance(eta, table):
    """Share of diffuse light that the surface reflects back inside. By reciprocity it is 1 - (1 - r) / eta^2, with r the share of
    diffuse light that the surface reflects outside.
    """
    nodes, weights = np.polynomial.legendre.leggauss(_QUADRATURE)
    cosine = 0.5 * (nodes + 1)
    albedo = (
        _dielectric(cosine, eta)
        if table is None
        else np.interp(np.sqrt(cosine) * (_TABLE_SIZE - 1), np.arange(_TABLE_SIZE), table)
    )
    return 1 - (1 - float(np.sum(weights * cosine * albedo))) / eta**2


def _smith(v, alpha):
    """Smith's G1 of Beckmann's distribution (the rational fit of Walter 2007), for rows of unit vectors."""
    a = v[..., 2] / (alpha * np.sqrt(np.maximum(1e-12, 1 - v[..., 2] ** 2)))
    return np.where(a >= 1.6, 1.0, (3.535 * a + 2.181 * a * a) / (1 + 2.276 * a + 2.577 * a * a))


def _albedos(eta, alpha, cosines):
    """Directional albedo of the rough surface: quadrature over normals, in slopes."""
    nodes, weights = np.polynomial.legendre.leggauss(_QUADRATURE)
    # Normals: uniform quantiles of the slope distribution and of the azimuth.
    quantile, share = 0.5 * (nodes + 1), 0.5 * weights
    tan2 = -(alpha**2) * np.log1p(-quantile)
    azimuth = 2 * np.pi * (np.arange(_QUADRATURE) + 0.5) / _QUADRATURE
    z = 1 / np.sqrt(1 + tan2)
    radius = np.sqrt(1 - z * z)
    h = np.stack(
        [
            radius[:, None] * np.cos(azimuth),
            radius[:, None] * np.sin(azimuth),
            np.broadcast_to(z[:, None], (len(z), _QUADRATURE)),
        ],
        axis=-1,
    )
    albedos = np.empty(len(cosines))
    for k, mu in enumerate(cosines):
        view = np.array([np.sqrt(max(0.0, 1 - mu * mu)), 0, max(mu, 1e-4)])
        towards = h @ view
        lit = 2 * towards[..., None] * h - view
        valid = (towards > 0) & (lit[..., 2] > 0)
        # f cosine / pdf of normals drawn by D h.z: F G (v.h) / (v.z h.z).
        weight = _dielectric(np.clip(towards, 1e-6, 1), eta) * _smith(view, alpha) * _smith(lit, alpha) * towards
        albedos[k] = np.sum(np.where(valid, weight / (view[2] * h[..., 2]), 0) * share[:, None]) / _QUADRATURE
    return np.minimum(albedos, 1).astype(np.float32)
