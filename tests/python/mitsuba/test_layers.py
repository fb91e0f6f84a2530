"""Coats, flakes and bases."""

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest
from scenes import follows_pdf, glint, make_scene, render, render_batches

import glint_ndf as gn
from glint_ndf.mitsuba.coat import Coat, _albedos

WHITE = {"type": "diffuse", "reflectance": 1.0}


def stack(asset, **parameters):
    return glint(asset, sigma=20.0, **parameters)


@pytest.mark.parametrize("coat", [{}, {"coat_alpha": 0.2}])
@pytest.mark.parametrize("transparency", [0.0, 0.5, 1.0])
def test_layers_add_no_energy(llvm, noise_pyramid, coat, transparency):
    """White layers under even light reflect at most all of it. A base keeps almost all. Steep facets lose what they turn beyond
    the critical angle of the coat: a third here.
    """
    bsdf = stack(noise_pyramid, coat=1.5, transparency=transparency, base=WHITE, **coat)
    image = render(make_scene(bsdf, "constant", "direct"), 256)
    assert image.mean() < 1.005
    assert image.mean() > (0.95 if transparency == 1 else 0.65)


#: Bases that reflect all light, and the least share of the light that must leave a coat over them. Glossy light that the coat reflects
#: back inside is lost, and a base whose diffuse part cannot be told apart gets no light back.
WHITE_BASES = {
    "plastic": ({"type": "plastic", "diffuse_reflectance": 1.0}, 0.93),
    "roughplastic": ({"type": "roughplastic", "diffuse_reflectance": 1.0, "alpha": 0.2}, 0.8),
    "smooth metal": ({"type": "conductor", "material": "none"}, 0.93),
    "metal": ({"type": "roughconductor", "material": "none", "alpha": 0.1}, 0.93),
    "rough metal": ({"type": "roughconductor", "material": "none", "alpha": 0.3}, 0.6),
    "principled metal": (
        {"type": "principled", "base_color": {"type": "rgb", "value": 1.0}, "metallic": 1.0, "roughness": 0.3},
        0.85,
    ),
    "principled": ({"type": "principled", "base_color": {"type": "rgb", "value": 1.0}, "roughness": 0.5}, 0.4),
    "mixed": ({"type": "blendbsdf", "weight": 0.5, "a": WHITE, "b": {"type": "roughconductor", "material": "none"}}, 0.7),
}

#: Means of 20000 weights, which deviate by up to 1 from their mean, are within this of their expectation.
NOISE_OF_WEIGHTS = 5 / 20_000**0.5


@pytest.mark.parametrize("coat", [{}, {"coat_alpha": 0.2}], ids=["smooth coat", "rough coat"])
@pytest.mark.parametrize("base", WHITE_BASES)
def test_a_coat_adds_no_energy_to_any_base(llvm, noise_pyramid, base, coat):
    """The mean weight of samples is the albedo. Light that a coat reflects back inside is given to diffuse parts alone."""
    description, least = WHITE_BASES[base]
    bsdf = mi.load_dict(stack(noise_pyramid, coat=1.5, transparency=1.0, base=description, **coat))
    lanes, random = 20_000, np.random.default_rng(5)
    for view in ((0, 0, 1), (0.6, 0, 0.8)):
        si = dr.zeros(mi.SurfaceInteraction3f, lanes)
        si.wi = view
        xi = random.random((3, lanes), dtype=np.float32)
        _, weight = bsdf.sample(mi.BSDFContext(), si, mi.Float(xi[0]), mi.Point2f(xi[1], xi[2]))
        albedo = np.array(weight).mean()
        assert least < albedo < 1 + NOISE_OF_WEIGHTS


def test_a_base_of_two_parts_answers_the_same_for_each_part(llvm, noise_pyramid):
    """What contexts for each component of a coated base answer adds up to the whole."""
    bsdf = mi.load_dict(
        stack(noise_pyramid, coat=1.5, transparency=1.0, base={"type": "roughplastic", "diffuse_reflectance": 1.0})
    )
    si = dr.zeros(mi.SurfaceInteraction3f)
    si.wi = dr.normalize(mi.Vector3f(0.1, 0.2, 1))
    lit = dr.normalize(mi.Vector3f(-0.2, -0.1, 1))
    parts = []
    for component in range(bsdf.component_count()):
        ctx = mi.BSDFContext()
        ctx.component = component
        parts.append(np.array(bsdf.eval(ctx, si, lit)).ravel())
    whole = np.array(bsdf.eval(mi.BSDFContext(), si, lit)).ravel()
    assert whole.min() > 0
    assert sum(parts) == pytest.approx(whole, rel=1e-5)


def test_a_coat_over_a_diffuse_base_is_mitsubas_plastic(llvm, noise_pyramid):
    """Facets that let everything through leave the coat and the base: Mitsuba's `plastic`, which counts light in the same way."""
    base = {"type": "diffuse", "reflectance": 0.5}
    ours = stack(noise_pyramid, coat=1.5, transparency=1.0, base=base)
    theirs = {"type": "plastic", "int_ior": 1.5, "ext_ior": 1.0, "diffuse_reflectance": 0.5, "nonlinear": True}
    mean_a, error_a = render_batches(make_scene(ours, "constant", "direct"), 128, 4)
    mean_b, error_b = render_batches(make_scene(theirs, "constant", "direct"), 128, 4, seed=50)
    deviation = np.sqrt((error_a**2 + error_b**2).sum()) / mean_a.size
    # Mitsuba tabulates the internal reflectance to about 1 in 1000.
    assert mean_a.mean() == pytest.approx(mean_b.mean(), abs=5 * deviation, rel=2e-3)


#: Largest error in albedo of the table of a coat, between its entries.
ERROR_OF_TABLE = 0.002


@pytest.mark.parametrize("alpha", [0.003, 0.01, 0.03, 0.1, 1.0])
def test_the_table_of_a_rough_coat_is_dense_enough(any_variant, alpha):
    """Also at low cosines, where the albedo of a smooth coat is steep."""
    cosines = np.concatenate([np.geomspace(1e-3, 0.1, 30), np.linspace(0.1, 1, 10)])
    coat = Coat(1.5, alpha)
    found = [float(np.array(coat.albedo(mi.Float(float(c)))).item()) for c in cosines]
    assert found == pytest.approx(_albedos(1.5, alpha, cosines), abs=ERROR_OF_TABLE)


@pytest.mark.parametrize("alpha", [0.01, 0.1, 0.5])
def test_albedo_of_a_rough_coat(llvm, alpha):
    """The table agrees with an integral over samples."""
    coat = Coat(1.5, alpha)
    lanes = 400_000
    xi = mi.Point2f(*np.random.default_rng(1).random((2, lanes), dtype=np.float32))
    for cosine in (1.0, 0.6, 0.2, 0.02):
        viewed = mi.Vector3f((1 - cosine**2) ** 0.5, 0, cosine)
        lit = coat.sample(None, viewed, xi, True)
        value, pdf = coat.evaluate(None, viewed, lit, True)
        albedo = float(np.array(dr.mean(dr.select(pdf > 0, value / pdf, 0))).item())
        assert float(np.array(coat.albedo(mi.Float(cosine))).item()) == pytest.approx(albedo, rel=0.01, abs=1e-3)


def test_samples_of_layers_follow_the_pdf(llvm, noise_pyramid):
    bsdf = stack(noise_pyramid, coat=1.5, coat_alpha=0.3, transparency=0.5, base={"type": "diffuse"})
    assert follows_pdf(mi.load_dict(bsdf), (0.4, 0.1, 0.9))


def test_smooth_coats_mirror(llvm, noise_pyramid):
    """The share of samples that a smooth coat mirrors is its reflectance, and their weight is that of a mirror."""
    bsdf = mi.load_dict(stack(noise_pyramid, coat=1.5))
    lanes = 10_000
    si = dr.zeros(mi.SurfaceInteraction3f, lanes)
    si.wi = [0, 0, 1]
    random = np.random.default_rng(3)
    drawn, weight = bsdf.sample(
        mi.BSDFContext(),
        si,
        mi.Float(random.random(lanes, dtype=np.float32)),
        mi.Point2f(*random.random((2, lanes), dtype=np.float32)),
    )
    mirrored = np.array(mi.has_flag(drawn.sampled_type, mi.BSDFFlags.DeltaReflection))
    reflectance = 0.04
    assert mirrored.mean() == pytest.approx(reflectance, abs=4 * np.sqrt(reflectance / lanes))
    assert np.array(weight)[0][mirrored] == pytest.approx(1, rel=1e-4)


def test_transparency_follows_the_map(llvm, noise_pyramid):
    """A texture of transparency is laid like the map: where it is 1, only the base shows."""
    half = np.zeros((4, 4, 1), dtype=np.float32)
    half[:, :2] = 1
    mask = {"type": "bitmap", "bitmap": mi.Bitmap(half), "raw": True, "filter_type": "nearest"}
    bsdf = mi.load_dict(stack(noise_pyramid, uv_scale=2.0, transparency=mask, base={"type": "diffuse", "reflectance": 0.5}))
    si = dr.zeros(mi.SurfaceInteraction3f, 2)
    si.uv = mi.Point2f([0.1, 0.4], [0.25, 0.25])  # 0.2 and 0.8 of the map
    si.wi = [0, 0, 1]
    value = np.array(bsdf.eval(mi.BSDFContext(), si, mi.Vector3f(0.95, 0, 0.312)))[0]
    assert value[0] == pytest.approx(0.5 * 0.312 / np.pi, rel=1e-3)
    assert value[1] < 0.1 * value[0]


def test_layers_agree_in_scalar_variants(noise_pyramid):
    values = {}
    for variant in ("scalar_rgb", "llvm_ad_rgb"):
        mi.set_variant(variant)
        bsdf = mi.load_dict(stack(noise_pyramid, coat=1.5, coat_alpha=0.2, transparency=0.5, base={"type": "diffuse"}))
        si = dr.zeros(mi.SurfaceInteraction3f)
        si.wi = dr.normalize(mi.Vector3f(0.1, 0.2, 1))
        values[variant] = [np.array(bsdf.eval(mi.BSDFContext(), si, dr.normalize(mi.Vector3f(-0.2, -0.1, 1)))).ravel()]
        for choice in (0.01, 0.4, 0.9):
            drawn, weight = bsdf.sample(mi.BSDFContext(), si, choice, mi.Point2f(0.3, 0.6), True)
            values[variant] += [np.array(drawn.wo).ravel(), np.array(weight).ravel(), np.array(drawn.pdf).ravel()]
    scalar, llvm = (np.concatenate(values[v]) for v in ("scalar_rgb", "llvm_ad_rgb"))
    assert scalar == pytest.approx(llvm, rel=2e-4, abs=1e-6)


def test_a_coat_can_have_normals_of_its_own(llvm, noise_pyramid, brushed_pyramid):
    bsdf = stack(brushed_pyramid, coat=1.5, coat_asset=noise_pyramid.path, coat_sigma=10.0)
    image = render(make_scene(bsdf, "constant", "direct"), 128)
    assert 0.8 < image.mean() < 1.02


def test_light_has_derivatives_by_the_base(llvm, noise_pyramid):
    """As differences of two values say; the gain under a coat is included."""
    si = dr.zeros(mi.SurfaceInteraction3f)
    si.wi = dr.normalize(mi.Vector3f(0.1, 0.2, 1))
    lit = dr.normalize(mi.Vector3f(-0.2, -0.1, 1))
    bsdf = mi.load_dict(stack(noise_pyramid, coat=1.5, transparency=0.5, base={"type": "diffuse", "reflectance": 0.5}))
    parameters = mi.traverse(bsdf)
    key = next(name for name in parameters.keys() if name.startswith("base") and "reflectance" in name)
    assert not parameters.flags(key) & int(mi.ParamFlags.NonDifferentiable)

    def value(reflectance):
        parameters[key] = type(parameters[key])(reflectance)
        dr.enable_grad(parameters[key])
        parameters.update()
        return dr.sum(bsdf.eval(mi.BSDFContext(), si, lit))

    def number(x):
        return float(np.array(dr.detach(x)).sum())

    step = 0.05
    difference = (number(value(0.5 + step)) - number(value(0.5 - step))) / (2 * step)
    dr.backward(value(0.5))
    # A central difference errs by the third derivative, here about step^2.
    assert number(dr.grad(parameters[key])) == pytest.approx(difference, rel=4 * step**2)
    assert difference > 0


def test_a_coat_of_the_index_of_air_is_no_coat(llvm, noise_pyramid):
    """Its other parameters are known all the same."""
    bsdf = stack(noise_pyramid, coat=1.0, coat_asset=noise_pyramid.path, coat_uv_scale=2.0)
    assert mi.load_dict(bsdf).layers.coat is None


def test_coat_alpha_is_the_roughness_of_a_coat_or_of_its_bin_map(llvm, noise, noise_pyramid):
    """No other asset of a coat reads it."""
    flakes = gn.bin_map(gn.synth("flakes", 64, seed=3), alpha=0.1, alpha_max=0.3)
    assert (
        mi.load_dict(stack(noise_pyramid, coat=1.5, coat_asset=flakes.path, coat_alpha=0.2, coat_sigma=4.0)).layers.coat.alpha
        == 0
    )
    with pytest.raises(Exception, match="'coat_alpha' is for assets of kind bin-map"):
        mi.load_dict(stack(noise_pyramid, coat=1.5, coat_asset=noise.path, coat_alpha=0.2))


def test_a_placement_of_a_coat_without_an_asset_is_refused(llvm, noise_pyramid):
    with pytest.raises(Exception, match="'coat_uv_scale' needs 'coat_asset'"):
        mi.load_dict(stack(noise_pyramid, coat=1.5, coat_uv_scale=2.0))
