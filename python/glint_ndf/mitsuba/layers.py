"""Layers of a surface: a clear coat over facets, and a base that shows between the facets (Atanasov 2021, section 6).

Below the coat the directions are those that the coat refracts. A pair of directions v, l reflects

    coat(v, l)  +  T(v) T(l) / eta^2  ( c facets(v', l')  +  (1 - c) ( gloss(v', l') + g diffuse(v', l') ) )

with T = 1 - albedo of the coat, c the share of the surface that the facets cover, gloss and diffuse the parts of the base, and
g = 1 / (1 - (c F + (1 - c) rho) R): the coat reflects the share R of the base's diffuse light back inside, and facets of reflectance F
and the diffuse part of albedo rho reflect it again. Glossy light that the coat reflects back inside is lost. No light is added: the
coat reflects 1 - T of the light from v; of the rest the facets return at most the share c, and the base at most 1 - c.
"""

import drjit as dr
import mitsuba as mi
import numpy as np

#: BSDFFlags::NeedsDifferentials, which Mitsuba 3.9 does not name in Python: `direct` then computes differentials (scalar variants).
_NEEDS_DIFFERENTIALS = 0x20000

#: Smallest cosine that is divided by. Directions this low carry no light.
_LEAST = 1e-6

#: nm: a visible wavelength.
_SOME_NM = 550.0

#: Cosines of a quadrature over diffuse light.
_NODES = 6

#: Stands for a pdf of 0 in a quotient that is not used.
_SMALLEST = 1e-30


class Layers:
    """All layers of one BSDF.

    Args:
        facets: the GlintLayer of the asset.
        conductor: reflectance of the facets; None: the asset has its own.
        coat: Coat or None.
        base: BSDF below the facets, or None.
        transparency: texture over the uv of the map: share of the surface where the base shows; None: 0.
    """

    def __init__(self, facets, conductor, coat, base, transparency):
        self.facets, self.conductor, self.coat, self.base, self.transparency = facets, conductor, coat, base, transparency
        self._base_component = 1 if coat is None else 2
        self._diffuse_part = "none" if coat is None or base is None else _diffuse_part(base)
        self._roundness = 1.0 if self._diffuse_part == "none" else _roundness(base)

    def components(self):
        """Flags: of the facets, then of the coat, then of the base."""
        glossy = mi.BSDFFlags.GlossyReflection | mi.BSDFFlags.FrontSide
        flags = [glossy | mi.BSDFFlags.Anisotropic | mi.BSDFFlags.SpatiallyVarying | _NEEDS_DIFFERENTIALS]
        if self.coat is not None:
            flags.append(mi.BSDFFlags.DeltaReflection | mi.BSDFFlags.FrontSide if self.coat.smooth else glossy)
        if self.base is not None:
            flags += [self.base.flags(k) for k in range(self.base.component_count())]
        return [int(f) for f in flags]

    def evaluate(self, ctx, si, lit, active):
        """Reflection times the cosine of `lit`, and pdf. Mirrors, which only samples find, count as 0."""
        viewed = si.wi
        active = active & (viewed.z > 0) & (lit.z > 0)
        covered = self._covered(si, active)
        shares = self._shares(ctx, viewed, covered)
        value, pdf = mi.Spectrum(0), mi.Float(0)
        v, l, through, squeeze = self._below(viewed, lit)
        if shares.has_facets:
            f, p = self.facets.evaluate(si, v, l, active)
            value += covered * through * lit.z * f * self.reflectance(si, v, l, active)
            pdf += shares.facets * squeeze * p
        if shares.has_base:
            f, p = self._evaluate_base(self._base_context(ctx), _seen_from(si, v), l, covered, active)
            value += (1 - covered) * through * (lit.z / dr.maximum(l.z, _LEAST)) * f
            pdf += shares.base * squeeze * p
        if shares.has_coat and not self.coat.smooth:
            f, p = self.coat.evaluate(si, viewed, lit, active)
            value += f
            pdf += shares.coat * p
        return dr.select(active, value, 0), dr.select(active, pdf, 0)

    def sample(self, ctx, si, sample1, sample2, active):
        """Chooses a layer by its share, and a direction by the layer. The pdf is the pdf of all layers together."""
        active = active & (si.wi.z > 0)
        if self.coat is None and self.base is None:
            return self._sample_facets(ctx, si, sample2, active)
        shares = self._shares(ctx, si.wi, self._covered(si, active))
        record = dr.zeros(mi.BSDFSample3f)
        record.eta = 1.0
        record.sampled_type = mi.UInt32(int(mi.BSDFFlags.GlossyReflection))
        mirrored, weight = False, mi.Spectrum(0)

        if shares.has_coat:
            chosen = active & (sample1 < shares.coat)
            record.wo = dr.select(chosen, self.coat.sample(si, si.wi, sample2, chosen), record.wo)
            record.sampled_component = dr.select(chosen, mi.UInt32(1), record.sampled_component)
            if self.coat.smooth:
                record.sampled_type = dr.select(chosen, mi.UInt32(int(mi.BSDFFlags.DeltaReflection)), record.sampled_type)
                record.pdf = dr.select(chosen, shares.coat, record.pdf)
                weight = dr.select(chosen, mi.Spectrum(self.coat.albedo(si.wi.z) / dr.maximum(shares.coat, _LEAST)), weight)
                mirrored = chosen
        v = si.wi if self.coat is None else self.coat.inside(si.wi)
        if shares.has_facets:
            chosen = active & (sample1 >= shares.coat) & (sample1 < shares.coat + shares.facets)
            lit, _, pdf = self.facets.sample(si, v, sample2, chosen)
            chosen &= pdf > 0
            record.wo = dr.select(chosen, self._above(lit), record.wo)
        if shares.has_base:
            start = shares.coat + shares.facets
            chosen = active & (sample1 >= start)
            again = dr.clip((sample1 - start) / dr.maximum(shares.base, _LEAST), 0, 1)
            drawn, w = self.base.sample(self._base_context(ctx), _seen_from(si, v), again, sample2, chosen)
            chosen &= drawn.pdf > 0
            record.wo = dr.select(chosen, self._above(drawn.wo), record.wo)
            record.sampled_type = dr.select(chosen, drawn.sampled_type, record.sampled_type)
            record.sampled_component = dr.select(
                chosen, drawn.sampled_component + self._base_component, record.sampled_component
            )
            of_mirror = chosen & mi.has_flag(drawn.sampled_type, mi.BSDFFlags.Delta)
            record.pdf = dr.select(of_mirror, shares.base * drawn.pdf, record.pdf)
            covered, through = self._covered(si, active), self._below(si.wi, record.wo)[2] * self._eta2()
            part = (1 - covered) * through / dr.maximum(shares.base, _LEAST)
            weight = dr.select(of_mirror, w * part, weight)
            mirrored = mirrored | of_mirror

        smooth = active & (record.wo.z > 0) & _inverted(mirrored)
        value, pdf = self.evaluate(ctx, si, record.wo, smooth)
        record.pdf = dr.select(smooth, pdf, dr.select(mirrored & (record.wo.z > 0), record.pdf, 0))
        weight = dr.select(smooth, value / dr.maximum(pdf, _SMALLEST), dr.select(mirrored, weight, 0))
        return record, dr.select(record.pdf > 0, weight, 0)

    def _sample_facets(self, ctx, si, xi, active):
        record = dr.zeros(mi.BSDFSample3f)
        if not ctx.is_enabled(mi.BSDFFlags.GlossyReflection, 0):
            return record, mi.Spectrum(0)
        record.wo, weight, record.pdf = self.facets.sample(si, si.wi, xi, active)
        record.eta = 1.0
        record.sampled_type = mi.UInt32(int(mi.BSDFFlags.GlossyReflection))
        weight = weight * self.reflectance(si, si.wi, record.wo, active)
        return record, dr.select(active & (record.pdf > 0), weight, 0)

    def traverse(self, callback):
        if self.conductor is not None:
            self.conductor.traverse(callback)
        if self.base is not None:
            callback.put("base", self.base, mi.ParamFlags.Differentiable)
            # Shares of the layers, by which samples are drawn, depend on the transparency.
            callback.put("transparency", self.transparency, mi.ParamFlags.NonDifferentiable)

    def _below(self, viewed, lit):
        """Both directions below the coat, T T / eta^2, and the solid angle below over that above."""
        if self.coat is None:
            return viewed, lit, 1, 1
        v, l, eta2 = self.coat.inside(viewed), self.coat.inside(lit), self._eta2()
        through = (1 - self.coat.albedo(viewed.z)) * (1 - self.coat.albedo(lit.z)) / eta2
        return v, l, through, lit.z / (eta2 * dr.maximum(l.z, _LEAST))

    def _above(self, lit):
        return lit if self.coat is None else self.coat.outside(lit)

    def _eta2(self):
        return 1.0 if self.coat is None else self.coat.eta**2

    def _covered(self, si, active):
        """Share of the surface that the facets cover."""
        if self.transparency is None:
            return mi.Float(1)
        placed = mi.SurfaceInteraction3f(si)
        placed.uv = self.facets.placement.uv(si.uv)
        return dr.clip(1 - self.transparency.eval_1(placed, active), 0, 1)

    def _evaluate_base(self, ctx, si, lit, covered, active):
        """The base times the cosine of `lit`, with the gain of its diffuse part, and pdf. Directions are below the coat."""
        f, pdf = self.base.eval_pdf(ctx, si, lit, active)
        if self._diffuse_part == "none":
            return f, pdf
        diffuse = _diffuse_context(ctx)
        of_diffuse = f if self._diffuse_part == "all" else self.base.eval(diffuse, si, lit, active)
        # Albedo of the diffuse part, by its value along the normal.
        up = mi.Vector3f(0, 0, 1)
        along_normal = self.base.eval(_diffuse_context(mi.BSDFContext()), _seen_from(si, up), up, active)
        albedo = dr.clip(self._roundness * dr.pi * along_normal, 0, 1)
        of_facets = 0 if self.conductor is None else dr.minimum(self.reflectance(si, up, up, active), 1)
        gain = 1 / (1 - self.coat.internal * (covered * of_facets + (1 - covered) * albedo))
        return f + (gain - 1) * of_diffuse, pdf

    def reflectance(self, si, v, l, active):
        """Fresnel's share of the facets between two directions."""
        if self.conductor is None:
            return 1
        h = v + l
        cosine = dr.dot(v, h) * dr.rsqrt(dr.maximum(dr.squared_norm(h), _LEAST))
        return self.conductor.reflectance(si, dr.clip(cosine, 0, 1), active)

    def _shares(self, ctx, viewed, covered):
        has_coat = self.coat is not None and ctx.is_enabled(self._coat_flag(), 1)
        has_facets = ctx.is_enabled(mi.BSDFFlags.GlossyReflection, 0)
        has_base = self.base is not None and (ctx.component == _ALL or ctx.component >= self._base_component)
        return _Shares(has_coat, has_facets, has_base, 0 if self.coat is None else self.coat.albedo(viewed.z), covered)

    def _coat_flag(self):
        return mi.BSDFFlags.DeltaReflection if self.coat.smooth else mi.BSDFFlags.GlossyReflection

    def _base_context(self, ctx):
        of_base = mi.BSDFContext(ctx.mode)
        of_base.type_mask = ctx.type_mask
        of_base.component = _ALL if ctx.component == _ALL else ctx.component - self._base_component
        return of_base


class _Shares:
    """Probability with which each layer is sampled: of those that the context asks for."""

    def __init__(self, has_coat, has_facets, has_base, coat_albedo, covered):
        self.has_coat, self.has_facets, self.has_base = has_coat, has_facets, has_base
        coat = coat_albedo if has_coat else 0
        facets = (1 - coat_albedo) * covered if has_facets else 0
        base = (1 - coat_albedo) * (1 - covered) if has_base else 0
        scale = 1 / dr.maximum(coat + facets + base, _LEAST)
        self.coat, self.facets, self.base = coat * scale, facets * scale, base * scale


_ALL = 0xFFFFFFFF


def _diffuse_part(base):
    """How much of a base is diffuse: "all", "some", or "none". It counts as "none" where the base does not answer for its lobes apart:
    such a BSDF gives light to a context that asks for no lobe.
    """
    diffuse = [mi.has_flag(base.flags(k), mi.BSDFFlags.DiffuseReflection) for k in range(base.component_count())]
    if all(diffuse) and diffuse:
        return "all"
    if not any(diffuse):
        return "none"
    nothing = mi.BSDFContext()
    nothing.type_mask = 0
    return "none" if _value(base, nothing, 1, 1, (0.5, 0.5)) > 0 else "some"


def _roundness(base):
    """Albedo of the diffuse part of a base for diffuse light, over pi times its value along the normal: 1 for a diffuse BSDF, less for
    a base with a surface of its own, which reflects low light before the light gets to the diffuse part.
    """
    nodes, weights = np.polynomial.legendre.leggauss(_NODES)
    cosines, weights = 0.5 * (nodes + 1), 0.5 * weights
    diffuse, uvs = _diffuse_context(mi.BSDFContext()), [(0.1 + 0.2 * k, (0.3 + 0.6 * k) % 1) for k in range(5)]
    for uv in uvs:
        along_normal = _value(base, diffuse, 1, 1, uv)
        if along_normal > 0:
            mean = sum(
                4 * a * m * b * _value(base, diffuse, m, c, uv)
                for m, a in zip(cosines, weights)
                for c, b in zip(cosines, weights)
            )
            return float(mean / along_normal)
    return 0.0  # black


def _value(base, ctx, view_cosine, lit_cosine, uv):
    """Mean over the spectrum of a BSDF times the cosine of the light, between two directions a quarter turn apart."""
    si = dr.zeros(mi.SurfaceInteraction3f)
    si.uv, si.wavelengths = uv, dr.full(type(si.wavelengths), _SOME_NM)
    si.wi = mi.Vector3f(float(1 - view_cosine**2) ** 0.5, 0, float(view_cosine))
    answer = base.eval(ctx, si, mi.Vector3f(0, float(1 - lit_cosine**2) ** 0.5, float(lit_cosine)))
    return float(np.mean(np.array(answer)))


def _diffuse_context(ctx):
    """A context that asks for the diffuse lobes of those that `ctx` asks for."""
    diffuse = mi.BSDFContext(ctx.mode)
    diffuse.type_mask, diffuse.component = ctx.type_mask & int(mi.BSDFFlags.Diffuse), ctx.component
    return diffuse


def _seen_from(si, direction):
    """The same interaction, viewed from another direction."""
    turned = mi.SurfaceInteraction3f(si)
    turned.wi = direction
    return turned


def _inverted(mask):
    """`not` for masks of every variant."""
    return mask ^ True
