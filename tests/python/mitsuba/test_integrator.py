"""The integrator `glint_path`: the light is that of Mitsuba's `path`, and every hit knows its footprint."""

import mitsuba as mi
import numpy as np
import pytest
from scenes import glint, make_scene, render, render_batches

import glint_ndf.mitsuba as gm
from glint_ndf.mitsuba import footprints, integrator

#: Means of pictures agree within this many standard errors.
DEVIATIONS = 5


def room(**parameters):
    """Diffuse, glossy and refracting shapes under three kinds of light."""
    transform = mi.ScalarTransform4f
    return mi.load_dict(
        {
            "type": "scene",
            "integrator": parameters,
            "floor": {"type": "rectangle", "to_world": transform().scale(3), "bsdf": {"type": "diffuse", "reflectance": 0.6}},
            "glass": {"type": "sphere", "center": [0, 0, 0.7], "radius": 0.6, "bsdf": {"type": "dielectric"}},
            "metal": {
                "type": "cube",
                "to_world": transform().translate([1.6, 0.5, 0.5]).scale(0.5),
                "bsdf": {"type": "roughconductor", "alpha": 0.15, "material": "Cu"},
            },
            "lamp": {"type": "sphere", "center": [-1, -1, 2.5], "radius": 0.3, "emitter": {"type": "area", "radiance": 8.0}},
            "sky": {"type": "constant", "radiance": 0.3},
            "point": {"type": "point", "position": [1, -2, 2], "intensity": 2.0},
            "camera": {
                "type": "perspective",
                "fov": 50,
                "to_world": transform().look_at([0, -4, 3], [0, 0, 0.5], [0, 0, 1]),
                "film": {"type": "hdrfilm", "width": 24, "height": 24, "pixel_format": "rgb", "rfilter": {"type": "box"}},
                "sampler": {"type": "independent"},
            },
        }
    )


@pytest.mark.parametrize(
    "options", [{"max_depth": 6}, {"max_depth": 2}, {"max_depth": 1}, {"max_depth": 5, "hide_emitters": True}]
)
def test_the_light_is_that_of_path(llvm, options):
    mean_a, error_a = render_batches(room(type="glint_path", **options), 64, 4)
    mean_b, error_b = render_batches(room(type="path", **options), 64, 4, seed=77)
    deviation = np.sqrt((error_a**2 + error_b**2).sum()) / mean_a.size
    assert mean_a.mean() == pytest.approx(mean_b.mean(), abs=DEVIATIONS * deviation + 1e-6)
    assert deviation < 0.02 * mean_b.mean() + 1e-6


@pytest.mark.parametrize("variant, spp", [("llvm_ad_rgb", 16), ("scalar_rgb", 1)])
def test_hidden_lamps_show_what_lies_behind_them(variant, spp):
    """Pixel by pixel as in `path`: one lamp behind another, and a floor or nothing behind both. Light of a constant sky on a diffuse
    floor is seen at depth 2, where few samples deviate little.
    """
    mi.set_variant(variant)
    transform = mi.ScalarTransform4f
    lamp = {"type": "sphere", "radius": 0.3, "emitter": {"type": "area", "radiance": 0.01}}
    images = {}
    for name in ("glint_path", "path"):
        scene = mi.load_dict(
            {
                "type": "scene",
                "integrator": {"type": name, "max_depth": 2, "hide_emitters": True},
                "floor": {"type": "rectangle", "bsdf": {"type": "diffuse", "reflectance": 0.6}},
                "near": {**lamp, "center": [0, 0, 2.0]},
                "far": {**lamp, "center": [0, 0, 1.0]},
                "aside": {**lamp, "center": [1.2, 0, 0.5]},
                "sky": {"type": "constant", "radiance": 1.0},
                "camera": {
                    "type": "perspective",
                    "fov": 40,
                    "to_world": transform().look_at([0, 0, 5], [0, 0, 0], [0, 1, 0]),
                    "film": {"type": "hdrfilm", "width": 16, "height": 16, "pixel_format": "rgba", "rfilter": {"type": "box"}},
                    "sampler": {"type": "independent"},
                },
            }
        )
        images[name] = render(scene, 16 * spp)
    difference = np.abs(images["glint_path"] - images["path"])
    middle = images["path"][7:9, 7:9]
    assert middle.min() > 0.3  # the floor, not a lamp
    assert images["path"][..., 3].min() == 0  # beside the floor
    assert difference[..., 3].max() < 0.5  # pixels on the border of the floor have shares
    assert difference[..., 3].mean() < 0.02
    assert difference[7:9, 7:9].max() < 0.25 * middle.max()
    assert difference.mean() < 0.03


def test_long_paths_in_scalar_variants():
    """Russian roulette included."""
    images = {}
    for variant, spp in (("scalar_rgb", 4), ("llvm_ad_rgb", 64)):
        mi.set_variant(variant)
        images[variant] = render(room(type="glint_path", max_depth=12, rr_depth=2), spp).mean()
    assert images["scalar_rgb"] == pytest.approx(images["llvm_ad_rgb"], rel=0.1)


def test_glints_agree_with_path(llvm, noise_pyramid):
    material = glint(noise_pyramid, material="Au", sigma=10.0)
    mean_a, error_a = render_batches(make_scene(material, "area", "glint_path"), 64, 4)
    mean_b, error_b = render_batches(make_scene(material, "area", "path"), 64, 4, seed=9)
    deviation = np.sqrt((error_a**2 + error_b**2).sum()) / mean_a.size
    assert mean_a.mean() == pytest.approx(mean_b.mean(), abs=DEVIATIONS * deviation)


def test_the_plain_render_of_mitsuba_works(any_variant, noise_pyramid):
    """The integrator sets the flags of Dr.Jit itself."""
    scene = make_scene(glint(noise_pyramid), "area", "glint_path", size=8)
    assert np.array(mi.render(scene, spp=2)).mean() > 0


def test_passes_average(llvm, noise_pyramid, monkeypatch):
    scene = make_scene(glint(noise_pyramid, sigma=10.0), "constant", "glint_path", size=8)
    whole = render(scene, 256)
    monkeypatch.setattr(integrator, "_MOST_LANES", 8 * 8 * 60)
    split = render(scene, 256)
    assert split.mean() == pytest.approx(whole.mean(), rel=0.01)
    assert not np.array_equal(split, whole)
    # The passes of one rendering are not those of the next seed.
    monkeypatch.setattr(integrator, "_MOST_LANES", 8 * 8 * 4)
    first, second = render(scene, 8, seed=1), render(scene, 8, seed=2)
    shared = 2 * np.abs(first - second).mean() / (np.abs(first - whole).mean() + np.abs(second - whole).mean())
    assert shared > 1.2


def test_passes_leave_the_sampler_as_it_was(llvm, noise_pyramid, monkeypatch):
    scene = make_scene(glint(noise_pyramid, sigma=10.0), "constant", "glint_path", size=8)
    sampler = scene.sensors()[0].sampler()
    sampler.set_sample_count(128)
    monkeypatch.setattr(integrator, "_MOST_LANES", 8 * 8 * 60)
    render(scene, 0)
    assert sampler.sample_count() == 128


def test_neighbouring_seeds_share_no_pass(llvm, noise_pyramid, monkeypatch):
    """The second of two passes with seed 0 is not the first with seed 1, and the first is that of a single pass."""
    scene = make_scene(glint(noise_pyramid, sigma=10.0), "area", "glint_path", size=8)
    first, other = render(scene, 16, seed=0), render(scene, 16, seed=1)
    monkeypatch.setattr(integrator, "_MOST_LANES", 8 * 8 * 16)
    second = 2 * render(scene, 32, seed=0) - first
    differences = [np.abs(second - image).mean() for image in (other, first)]
    # Independent pictures of 16 samples deviate by far more than rounding.
    assert min(differences) > 0.1 * np.abs(other - first).mean()


@pytest.fixture
def seen_footprints(monkeypatch):
    """Deviations in texels of all footprints that materials ask for, in order of the calls."""
    seen = []
    original = footprints.Footprints.of

    def of(self, dx, dy):
        covariance = original(self, dx, dy)
        seen.append(np.sqrt(0.5 * (covariance[:, 0] + covariance[:, 2])))
        return covariance

    monkeypatch.setattr(footprints.Footprints, "of", of)
    return seen


def straight_down(noise_pyramid, mirror, footprint):
    """A camera in the middle looks up at a mirror at z = 2, or down at a map of 128 texels in 2 units at z = 0, from z = 1."""
    transform = mi.ScalarTransform4f
    up = mirror is not None
    scene = {
        "type": "scene",
        "integrator": {"type": "glint_path", "max_depth": 3, "footprint": footprint},
        "map": {"type": "rectangle", "bsdf": glint(noise_pyramid)},
        "light": {"type": "constant"},
        "camera": {
            "type": "perspective",
            "fov": 10,
            "to_world": transform().look_at([0, 0, 1], [0, 0, 2 if up else 0], [0, 1, 0]),
            "film": {"type": "hdrfilm", "width": 16, "height": 16, "rfilter": {"type": "box"}},
            "sampler": {"type": "independent"},
        },
    }
    if up:
        scene["mirror"] = {
            "type": "rectangle",
            "to_world": transform().translate([0, 0, 2]).rotate([1, 0, 0], 180),
            "bsdf": mirror,
        }
    return mi.load_dict(scene)


#: Units from one pixel of the camera to the next at distance 1, times texels in a unit.
TEXELS_PER_PIXEL = 2 * np.tan(np.radians(5)) / 16 * 64


@pytest.mark.parametrize("footprint, samples", [("pixel", 1), ("sample", 2)])
def test_footprints_of_the_first_hit(llvm, noise_pyramid, seen_footprints, footprint, samples):
    """Half of a pixel, or of the part of it that one sample stands for."""
    render(straight_down(noise_pyramid, None, footprint), 4)
    expected = 0.5 * TEXELS_PER_PIXEL / samples
    assert np.median(seen_footprints[0]) == pytest.approx(expected, rel=0.02)


def test_footprints_in_a_mirror(llvm, noise_pyramid, seen_footprints):
    """A mirror adds its distance: the light has gone 1 + 2 units."""
    render(straight_down(noise_pyramid, {"type": "conductor", "material": "none"}, "pixel"), 4)
    assert np.median(seen_footprints[0]) == pytest.approx(3 * 0.5 * TEXELS_PER_PIXEL, rel=0.02)


def test_footprints_grow_with_roughness(llvm, noise_pyramid, seen_footprints):
    medians = []
    for bsdf in (
        {"type": "roughconductor", "alpha": 0.01},
        {"type": "roughconductor", "alpha": 0.1},
        {"type": "diffuse"},
    ):
        seen_footprints.clear()
        render(straight_down(noise_pyramid, bsdf, "pixel"), 64)
        medians.append(np.median(np.concatenate(seen_footprints)))
    smooth, rough, diffuse = medians
    # Directions that a Beckmann lobe reflects deviate by sqrt(2) alpha per axis, over a distance of 2 units of 64 texels.
    assert rough == pytest.approx(2**0.5 * 0.1 * 2 * 64, rel=0.15)
    assert smooth < 0.3 * rough
    assert diffuse > 2 * rough


def test_curved_mirrors_widen_footprints(llvm, noise_pyramid, seen_footprints):
    """A ball of radius 1 behind the camera in front of the camera spreads the beam as geometric optics says."""
    transform = mi.ScalarTransform4f
    scene = mi.load_dict(
        {
            "type": "scene",
            "integrator": {"type": "glint_path", "max_depth": 3, "footprint": "pixel"},
            "map": {"type": "rectangle", "bsdf": glint(noise_pyramid)},
            "ball": {"type": "sphere", "center": [0, 0, 3], "radius": 1, "bsdf": {"type": "conductor", "material": "none"}},
            "light": {"type": "constant"},
            "camera": {
                "type": "perspective",
                "fov": 2,
                "to_world": transform().look_at([0, 0, 1], [0, 0, 2], [0, 1, 0]),
                "film": {"type": "hdrfilm", "width": 16, "height": 16, "rfilter": {"type": "box"}},
            },
        }
    )
    render(scene, 1)
    step = 2 * np.tan(np.radians(1)) / 16
    # At the ball, at distance 1, a step turns the normal by step / radius and the direction by twice that; the map is 2 units away.
    expected = 0.5 * 64 * (step * (1 + 2) + 2 * step * 2)
    assert np.median(seen_footprints[0]) == pytest.approx(expected, rel=0.02)


def test_unknown_options_are_refused(llvm):
    with pytest.raises(Exception, match="glint_path"):
        mi.load_dict({"type": "glint_path", "depth": 3})
    with pytest.raises(Exception, match="max_depth"):
        mi.load_dict({"type": "glint_path", "max_depth": -2})


def test_flags_are_restored(llvm, noise_pyramid):
    import drjit as dr

    before = dr.flag(dr.JitFlag.SymbolicLoops), dr.flag(dr.JitFlag.SymbolicCalls)
    with gm.wavefront():
        assert not dr.flag(dr.JitFlag.SymbolicLoops)
    assert (dr.flag(dr.JitFlag.SymbolicLoops), dr.flag(dr.JitFlag.SymbolicCalls)) == before
