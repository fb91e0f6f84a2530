"""Scenes and pictures of the tests of the Mitsuba plugins."""

import drjit as dr
import mitsuba as mi
import numpy as np

import glint_ndf.mitsuba as gm


def make_scene(bsdf, light, integrator="path", size=16, distance=3.0, turn=0.0):
    """A square of 2 x 2 units in the plane z = 0, seen from 45 degrees, under one light: "area", "point" or "constant". The square
    turns about z by `turn` degrees.
    """
    transform = mi.ScalarTransform4f
    square = {"type": "rectangle", "to_world": transform().rotate([0, 0, 1], turn), "bsdf": bsdf}
    lights = {
        "area": {
            "type": "rectangle",
            "to_world": transform().look_at([0, 2, 2], [0, 0, 0], [0, 0, 1]) @ transform().scale(0.5),
            "emitter": {"type": "area", "radiance": 5.0},
        },
        "point": {"type": "point", "position": [0, 2, 2], "intensity": 10.0},
        "constant": {"type": "constant"},
    }
    camera = {
        "type": "perspective",
        "fov": 25,
        "to_world": transform().look_at([0, -distance, distance], [0, 0, 0], [0, 0, 1]),
        "film": {"type": "hdrfilm", "width": size, "height": size, "pixel_format": "rgb", "rfilter": {"type": "box"}},
        "sampler": {"type": "independent"},
    }
    parts = {"square": square, "light": lights[light], "camera": camera}
    return mi.load_dict(
        {"type": "scene", "integrator": integrator if isinstance(integrator, dict) else {"type": integrator}, **parts}
    )


def glint(asset, **parameters):
    """A BSDF of an asset that reflects everything, unless the parameters say otherwise."""
    return {"type": "glint", "asset": asset.path, "material": "none", **parameters}


def render(scene, spp, seed=0):
    """An image as an array of doubles."""
    return np.array(gm.render(scene, spp=spp, seed=seed), dtype=np.float64)


def render_batches(scene, spp, batches, seed=0):
    """Mean image of several renderings, and the standard error of each pixel."""
    images = np.stack([render(scene, spp, seed + 1000 * k) for k in range(batches)])
    return images.mean(axis=0), images.std(axis=0, ddof=1) / np.sqrt(batches)


def follows_pdf(bsdf, view, sample_count=200_000):
    """Mitsuba's chi-squared test of `sample` against `pdf`.

    Every sample with a pdf counts, also where the BSDF is 0 (Mitsuba's own adapter drops those): a part of the samples is spread
    over the whole hemisphere. Samples without a pdf are missing from both sides.
    """
    from mitsuba import chi2  # exists once a variant is set

    direction = (np.array(view) / np.linalg.norm(view)).tolist()

    def interaction(lanes):
        si = dr.zeros(mi.SurfaceInteraction3f, lanes)
        si.wi, si.uv = direction, [0.5, 0.5]
        return si

    def sample(xi):
        drawn, _ = bsdf.sample(mi.BSDFContext(), interaction(dr.width(xi)), xi[0], mi.Point2f(xi[1], xi[2]))
        return drawn.wo, dr.select(drawn.pdf > 0, mi.Float(1), 0)

    def pdf(wo):
        return bsdf.pdf(mi.BSDFContext(), interaction(dr.width(wo)), wo)

    domain = chi2.SphericalDomain()
    return chi2.ChiSquareTest(domain, sample, pdf, sample_dim=3, sample_count=sample_count, res=51, ires=8).run()
