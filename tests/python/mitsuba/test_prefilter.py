"""Environments as lobes, and the option `prefilter` of `glint_path`."""

import mitsuba as mi
import numpy as np
import pytest
from scenes import glint, render

import glint_ndf.mitsuba as gm
from glint_ndf.mitsuba import lobes


def unit(v):
    return np.array(v) / np.linalg.norm(v)


LAMPS = gm.Lobes(
    np.array([unit([0.3, 0.8, -0.5]), unit([-0.7, 0.5, 0.5]), unit([0.1, 1, 0.4])]),
    np.array([40.0, 15.0, 4.0]),
    np.array([[6.0, 5, 4], [1, 2, 4], [0.5, 0.5, 0.5]]),
)


def sky(rows=64):
    """An image of the lamps as Mitsuba's `envmap` takes it."""
    d, _ = lobes.grid(rows, 2 * rows)
    return LAMPS.radiance(np.stack([d[..., 1], d[..., 2], -d[..., 0]], axis=-1)).astype(np.float32)


def test_a_fit_finds_the_lobes_of_which_an_image_is_made():
    found = gm.fit_lobes(sky(), 3)
    directions, solid = lobes.grid()
    wanted, got = LAMPS.radiance(directions), found.radiance(directions)
    weight = np.sqrt(solid)[..., None]
    assert np.linalg.norm((got - wanted) * weight) < 0.15 * np.linalg.norm(wanted * weight)
    # The whole power is kept, in each channel.
    assert (solid[..., None] * got).sum(axis=(0, 1)) == pytest.approx((solid[..., None] * wanted).sum(axis=(0, 1)), rel=0.01)


@pytest.mark.parametrize("image", [np.ones((16, 32, 3)), sky(16)], ids=["even", "lamps"])
@pytest.mark.parametrize("count", [1, 3])
def test_axes_are_unit_vectors(image, count):
    """Also where light comes evenly from all sides, which has no mean direction."""
    found = gm.fit_lobes(image, count)
    assert np.linalg.norm(found.axes, axis=1) == pytest.approx(np.ones(count), abs=1e-9)


def test_the_brightest_lobe_lies_where_mitsuba_shows_it(llvm):
    """The frame of the fit is that of `envmap`."""
    found = gm.fit_lobes(sky(), 3)
    axis = found.axes[found.amplitudes.sum(axis=1).argmax()]
    environment = mi.load_dict({"type": "envmap", "bitmap": mi.Bitmap(sky())})
    si = mi.SurfaceInteraction3f()
    si.wi = mi.Vector3f(*(-axis).tolist())
    assert np.array(environment.eval(si)).ravel() == pytest.approx(LAMPS.radiance(axis), rel=0.05)


def test_dark_images_have_dark_lobes():
    assert not gm.fit_lobes(np.zeros((8, 16, 3)), 4).amplitudes.any()


@pytest.mark.parametrize("bitmap, count", [(np.zeros((4, 4)), 3), (np.full((4, 8, 3), np.nan), 3), (np.ones((4, 8, 3)), 0)])
def test_bad_images_are_refused(bitmap, count):
    with pytest.raises(ValueError):
        gm.fit_lobes(bitmap, count)


def plate(noise_pyramid, prefilter, size=12, **more):
    transform = mi.ScalarTransform4f
    return mi.load_dict(
        {
            **more,
            "type": "scene",
            "integrator": {"type": "glint_path", "max_depth": 2, "prefilter": prefilter},
            "plate": {"type": "rectangle", "bsdf": glint(noise_pyramid, material="Al", sigma=20.0)},
            "blocker": {
                "type": "rectangle",
                "to_world": transform().translate([3, 0, 1]).rotate([0, 1, 0], -90),
                "bsdf": {"type": "diffuse"},
            },
            "sky": {"type": "envmap", "bitmap": mi.Bitmap(sky()), "to_world": transform().rotate([1, 0, 0], 90)},
            "camera": {
                "type": "perspective",
                "fov": 20,
                "to_world": transform().look_at([0, -2.5, 2.5], [0, 0, 0], [0, 0, 1]),
                "film": {"type": "hdrfilm", "width": size, "height": size, "pixel_format": "rgb", "rfilter": {"type": "box"}},
                "sampler": {"type": "independent"},
            },
        }
    )


@pytest.mark.parametrize("variant, spp", [("llvm_ad_rgb", 256), ("llvm_ad_spectral", 256), ("scalar_rgb", 4)])
def test_prefiltered_light_is_that_of_samples(noise_pyramid, variant, spp):
    """Up to the error of the fit and of lobes that stand for their axes."""
    mi.set_variant("llvm_ad_rgb")
    sampled = render(plate(noise_pyramid, 0), 256).mean(axis=(0, 1))
    mi.set_variant(variant)
    prefiltered = render(plate(noise_pyramid, 8), spp).mean(axis=(0, 1))
    assert prefiltered == pytest.approx(sampled, rel=0.15)


def test_a_closed_room_is_dark(llvm, noise_pyramid):
    """A black ball around plate and camera hides the whole sky."""
    black = {"type": "sphere", "radius": 20.0, "bsdf": {"type": "diffuse", "reflectance": 0.0}}
    assert render(plate(noise_pyramid, 4), 16).max() > 0
    assert render(plate(noise_pyramid, 4, ball=black), 16).max() == 0


def test_a_sky_that_changes_is_fitted_again(llvm, noise_pyramid):
    scene = plate(noise_pyramid, 4)
    before = render(scene, 16)
    parameters = mi.traverse(scene)
    parameters["sky.scale"] = 2.0 * parameters["sky.scale"]
    parameters.update()
    assert render(scene, 16) == pytest.approx(2 * before, rel=1e-3)


def test_a_picture_leaves_no_reference_to_the_scene(llvm, noise_pyramid):
    """The scene holds its integrator, so a reference back would keep both for ever."""
    scene = plate(noise_pyramid, 4)
    render(scene, 1)
    holders = [value for value in vars(scene.integrator()).values() if type(value).__name__ == "Prefilter"]
    assert not holders


def test_scenes_without_a_sky_are_left_alone(llvm, noise_pyramid):
    from scenes import make_scene

    scene = make_scene(glint(noise_pyramid, sigma=10.0), "area", {"type": "glint_path", "prefilter": 8})
    plain = make_scene(glint(noise_pyramid, sigma=10.0), "area", {"type": "glint_path"})
    assert np.array_equal(render(scene, 4), render(plain, 4))
