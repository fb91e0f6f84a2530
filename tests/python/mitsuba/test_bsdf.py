"""Known answers of the BSDF `glint`."""

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest
from scenes import follows_pdf, glint, make_scene, render, render_batches

import glint_ndf as gn
import glint_ndf.mitsuba as gm

#: sigma_r of a flat map whose lobe is Beckmann's: they differ by a share of the order of sigma_r^2, 4e-4, well below the noise.
SMALL_ROUGHNESS = 0.02

#: Deviations of z over pixels: the mean of 768 z values has a deviation of 0.036, their rms of 8 batches exceeds 1.3 by chance in
#: less than 1 of 1000 runs (Student's t of 7 degrees of freedom has an rms of 1.18).
LARGEST_MEAN_Z, LARGEST_RMS_Z = 0.25, 1.45


def z_values(a, b):
    """Differences of two images over their standard errors, of pixels that see light."""
    (mean_a, error_a), (mean_b, error_b) = a, b
    error = np.sqrt(error_a**2 + error_b**2)
    lit = error > 1e-3 * mean_b.max()
    return (mean_a - mean_b)[lit] / error[lit]


@pytest.mark.parametrize("kind", ["normals", "ndf-pyramid"])
def test_a_flat_map_is_a_rough_conductor(llvm, flat, kind):
    asset, options = (
        (flat, {"sigma_r": SMALL_ROUGHNESS}) if kind == "normals" else (gn.pyramid(flat, stride=4, sigma_r=SMALL_ROUGHNESS), {})
    )
    ours = make_scene(glint(asset, material="Au", sigma=1.0, **options), "area")
    theirs = make_scene({"type": "roughconductor", "alpha": 2**0.5 * SMALL_ROUGHNESS, "material": "Au"}, "area")
    z = z_values(render_batches(ours, 128, 8), render_batches(theirs, 128, 8, seed=99))
    assert len(z) > 50
    assert abs(z.mean()) < LARGEST_MEAN_Z
    assert np.sqrt(np.mean(z**2)) < LARGEST_RMS_Z


def test_white_furnace(any_variant, noise_pyramid):
    """Under even light nothing gains energy, and facets of moderate slope lose little of it."""
    spp = 4 if any_variant.startswith("scalar") else 256
    image = render(make_scene(glint(noise_pyramid, sigma=20.0), "constant", "direct"), spp)
    assert 0.9 < image.mean() < 1.005


def test_variants_agree(noise_pyramid):
    """The same seeds do not give the same samples, so means are compared."""
    means = {}
    for variant, spp in (("scalar_rgb", 24), ("llvm_ad_rgb", 512), ("llvm_ad_spectral", 512)):
        mi.set_variant(variant)
        image = render(make_scene(glint(noise_pyramid, material="Cu", sigma=10.0), "area", "direct"), spp)
        means[variant] = image.mean(axis=(0, 1))
    assert means["scalar_rgb"] == pytest.approx(means["llvm_ad_rgb"], rel=0.03)
    # Reflectance of copper by RGB and by wavelengths differs by a few percent.
    assert means["llvm_ad_spectral"] == pytest.approx(means["llvm_ad_rgb"], rel=0.08)


def test_scalar_and_llvm_give_the_same_values(noise_pyramid):
    values = {}
    for variant in ("scalar_rgb", "llvm_ad_rgb"):
        mi.set_variant(variant)
        bsdf = mi.load_dict(glint(noise_pyramid, material="Al", sigma=4.0, rotation=20.0, uv_scale=3.0))
        si = dr.zeros(mi.SurfaceInteraction3f)
        si.uv, si.wi = [0.3, 0.8], dr.normalize(mi.Vector3f(0.1, 0.2, 1))
        value, pdf = bsdf.eval_pdf(mi.BSDFContext(), si, dr.normalize(mi.Vector3f(-0.2, -0.1, 1)))
        values[variant] = np.append(np.array(value).ravel(), np.array(pdf).ravel())
    assert values["llvm_ad_rgb"].max() > 0
    assert values["scalar_rgb"] == pytest.approx(values["llvm_ad_rgb"], rel=1e-5)


def test_light_bsdf_and_mis_samples_agree(llvm, noise_pyramid):
    material = glint(noise_pyramid, material="Au", sigma=10.0)
    means = []
    for light, bsdf in ((0, 4), (4, 0), (2, 2)):
        integrator = {"type": "direct", "emitter_samples": light, "bsdf_samples": bsdf}
        image, error = render_batches(make_scene(material, "area", integrator), 128, 4, seed=light)
        means.append((image.mean(), np.sqrt((error**2).sum()) / image.size))
    (by_bsdf, _), (by_light, _), (by_both, _) = means
    deviation = np.sqrt(sum(e**2 for _, e in means))
    assert by_bsdf == pytest.approx(by_light, abs=5 * deviation)
    assert by_bsdf == pytest.approx(by_both, abs=5 * deviation)
    assert deviation < 0.01 * by_both


@pytest.mark.parametrize("view", [(0, 0, 1), (0.5, 0.2, 0.84)])
def test_samples_follow_the_pdf(llvm, noise_pyramid, view):
    assert follows_pdf(mi.load_dict(glint(noise_pyramid, sigma=30.0, rotation=30.0)), view)


def test_pyramid_agrees_with_the_texels(llvm, noise, noise_pyramid):
    """The picture of a pyramid is that of its texels, up to the error of footprints between its levels."""
    by_texels = render(make_scene(glint(noise, sigma_r=0.02, sigma=4.0), "point", "direct"), 16)
    by_pyramid = render(make_scene(glint(noise_pyramid, sigma=4.0), "point", "direct"), 16)
    difference = np.linalg.norm(by_pyramid - by_texels) / np.linalg.norm(by_texels)
    assert difference < 0.15
    assert by_pyramid.mean() == pytest.approx(by_texels.mean(), rel=0.03)


def test_the_seam_of_the_map_is_invisible(llvm, noise_pyramid):
    """Radiance does not jump from u = 1 - e to u = e, nor from v = 1 - e to v = e."""
    bsdf = mi.load_dict(glint(noise_pyramid, sigma=4.0))
    lanes, step = 64, 1e-5
    across = np.stack([np.full(2 * lanes, 1.0), np.tile(np.linspace(0.05, 0.95, lanes), 2)])
    across[0] += np.repeat([-step, step], lanes)
    for uv in (across, across[::-1]):
        si = dr.zeros(mi.SurfaceInteraction3f, 2 * lanes)
        si.uv = mi.Point2f(*uv.astype(np.float32))
        si.wi = dr.normalize(mi.Vector3f(0, 0.1, 1))
        before, after = np.array(bsdf.eval(mi.BSDFContext(), si, si.wi))[0].reshape(2, lanes)
        assert before.max() > 0.1
        assert after == pytest.approx(before, rel=1e-2, abs=1e-2 * float(before.max()))


#: The derivative has samples of its own: sums of 16 x 16 pixels of 128 samples deviate by less than 1 %.
NOISE_OF_LIGHT = 0.03


@pytest.mark.parametrize("integrator", ["glint_path", "direct"])
def test_light_has_derivatives_by_the_textures_of_the_conductor(llvm, noise_pyramid, integrator):
    """One reflection is proportional to specular_reflectance, so its derivative is the light over the reflectance."""
    reflectance = 0.5
    light = {"type": integrator} if integrator == "direct" else {"type": integrator, "max_depth": 2}
    scene = make_scene(glint(noise_pyramid, sigma=10.0, specular_reflectance=reflectance), "area", light)
    parameters = mi.traverse(scene)
    key = next(name for name in parameters.keys() if "specular_reflectance" in name)
    for name in ("specular_reflectance", "eta", "k"):
        flags = parameters.flags(key.replace("specular_reflectance", name))
        assert not flags & int(mi.ParamFlags.NonDifferentiable)
    dr.enable_grad(parameters[key])
    parameters.update()
    with gm.wavefront():
        # The lamp is not in view, so all light is reflected once.
        total = dr.sum(mi.render(scene, parameters, spp=128).array)
        dr.backward(total)
    assert float(dr.detach(total).numpy().item()) > 0
    assert dr.grad(parameters[key]).numpy().sum() == pytest.approx(
        dr.detach(total).numpy().item() / reflectance, rel=NOISE_OF_LIGHT
    )


def moments_of_highlight(image):
    """Second moments of brightness about its centre: xx, xy, yy in pixels, y downwards."""
    brightness = image.mean(axis=2)
    y, x = np.mgrid[: brightness.shape[0], : brightness.shape[1]]
    mean = lambda q: (q * brightness).sum() / brightness.sum()  # noqa: E731
    cx, cy = mean(x), mean(y)
    return mean((x - cx) ** 2), mean((x - cx) * (y - cy)), mean((y - cy) ** 2)


def test_rotation_turns_a_brushed_highlight(llvm, brushed_pyramid):
    """A map that turns by 45 degrees reflects as a plate that turns by 45 degrees, from dp/du towards dp/dv; and by -45 degrees a
    streak of light leans as much the other way.
    """
    leans = {}
    for rotation, turn in ((45.0, 0.0), (0.0, 45.0), (-45.0, 0.0)):
        scene = make_scene(glint(brushed_pyramid, sigma=40.0, rotation=rotation), "point", "direct", size=32, turn=turn)
        xx, xy, yy = moments_of_highlight(render(scene, 64))
        leans[rotation, turn] = xy / np.sqrt(xx * yy)
    by_map, by_plate, other_way = leans.values()
    assert abs(by_map) > 0.3
    assert by_map == pytest.approx(by_plate, abs=0.1)
    assert other_way == pytest.approx(-by_map, abs=0.1)


def test_mirrored_texture_turns_the_normals_with_the_picture(llvm, noise_pyramid):
    bsdf = mi.load_dict(glint(noise_pyramid, sigma=3.0))

    def value(sign):
        si = dr.zeros(mi.SurfaceInteraction3f)
        si.sh_frame = mi.Frame3f(mi.Normal3f(0, 0, 1))
        si.dp_du, si.dp_dv = mi.Vector3f(1, 0, 0), mi.Vector3f(0, sign, 0)
        si.uv = [0.4, 0.6]
        local = lambda v: si.to_local(dr.normalize(mi.Vector3f(v[0], sign * v[1], v[2])))  # noqa: E731
        si.wi = local((0.1, 0.3, 1))
        return np.array(bsdf.eval(mi.BSDFContext(), si, local((0, -0.1, 1))))

    assert value(1).max() > 0
    assert value(-1) == pytest.approx(value(1), rel=1e-4)


def test_displacement_assets_reflect(any_variant, displaced):
    spp = 4 if any_variant.startswith("scalar") else 64
    scene = make_scene({"type": "glint", "asset": displaced.path, "sigma": 8.0}, "constant", "direct")
    image = render(scene, spp)
    # A rough diffuse surface of albedo 0.8 under even light.
    assert 0.6 < image.mean() < 0.85
