"""Bad input: every error names the plugin and the file, and Python goes on."""

import os
import shutil
import warnings

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest
from scenes import glint, make_scene, render

import glint_ndf as gn
import glint_ndf.mitsuba as gm


def message_of(error):
    """The texts of an exception and of its causes: Mitsuba wraps errors of plugins."""
    texts = []
    while error is not None:
        texts.append(str(error))
        error = error.__cause__ or error.__context__
    return "\n".join(texts)


def refused(bsdf, *words):
    with pytest.raises(Exception) as caught:
        mi.load_dict(bsdf)
    text = message_of(caught.value)
    for word in ("glint", *words):
        assert word in text


def test_a_missing_file(any_variant):
    refused({"type": "glint", "asset": "no/such.glint"}, "no/such.glint", "no such file")


def test_the_text_of_an_error_of_loading_ends_with_that_of_the_plugin(any_variant):
    with pytest.raises(RuntimeError) as caught:
        mi.load_dict({"type": "glint", "asset": "no/such.glint"})
    assert (
        str(caught.value)
        .rstrip()
        .endswith("PluginError: glint: no/such.glint: there is no such file; give the path of a .glint asset")
    )


def test_a_missing_asset(llvm):
    refused({"type": "glint"}, "'asset' is missing")


def test_a_file_that_is_no_asset(llvm, tmp_path):
    path = tmp_path / "text.glint"
    path.write_text("not an asset")
    refused({"type": "glint", "asset": str(path)}, str(path))


def test_an_asset_of_another_kind(llvm):
    heights = gn.synth("isotropic", 32, heights=True)
    refused(glint(heights), heights.path, "heights")


def test_unknown_parameters(llvm, noise_pyramid):
    refused(glint(noise_pyramid, rotatoin=3.0), "rotatoin", "did you mean 'rotation'")


@pytest.mark.parametrize(
    "parameters, words",
    [
        ({"uv_scale": 0.0}, ("uv_scale",)),
        ({"uv_scale": "2"}, ("uv_scale", "number")),
        ({"uv_scale": 2.0, "texels_per_unit": 100.0}, ("texels_per_unit", "uv_scale")),
        ({"sigma": -1.0}, ("sigma",)),
        ({"interpolation": "cubic"}, ("interpolation", "trilinear")),
        ({"coat_alpha": 0.1}, ("coat", "missing")),
        ({"coat": 0.5}, ("coat",)),
        ({"transparency": 0.5}, ("base", "missing")),
        ({"base": {"type": "diffuse"}}, ("transparency", "missing")),
        ({"facets": "beckmann"}, ("bin-map",)),
        ({"material": "Unobtainium"}, ("Unobtainium",)),
        ({"normals": "no/such.glint"}, ("no/such.glint",)),
    ],
)
def test_parameters_out_of_range(llvm, noise_pyramid, parameters, words):
    refused(glint(noise_pyramid, **parameters), *words)


def test_a_conductor_over_a_displacement(llvm, displaced):
    refused({"type": "glint", "asset": displaced.path, "material": "Au"}, "material", "displacement")


def test_symbolic_loops(llvm, noise_pyramid):
    scene = make_scene(glint(noise_pyramid, sigma=4.0), "area", "path")
    with pytest.raises(Exception) as caught:
        mi.render(scene, spp=1)
    assert "glint_ndf.mitsuba.render" in message_of(caught.value)
    # The next rendering is sound.
    assert render(scene, 4).mean() > 0


def test_a_mesh_without_uv(any_variant, noise_pyramid, tmp_path):
    mesh = mi.Mesh("bare", 3, 1)
    parameters = mi.traverse(mesh)
    parameters["vertex_positions"] = [-1, -1, 0, 1, -1, 0, 0, 1, 0]
    parameters["faces"] = [0, 1, 2]
    parameters.update()
    path = str(tmp_path / "bare.ply")
    mesh.write_ply(path)
    scene = mi.load_dict(
        {
            "type": "scene",
            "integrator": {"type": "direct"},
            "mesh": {"type": "ply", "filename": path, "bsdf": glint(noise_pyramid, sigma=4.0)},
            "light": {"type": "constant"},
            "camera": {
                "type": "perspective",
                "to_world": mi.ScalarTransform4f().look_at([0, 0, 3], [0, 0, 0], [0, 1, 0]),
                "film": {"type": "hdrfilm", "width": 4, "height": 4},
            },
        }
    )
    with pytest.raises(gm.PluginError) as caught:
        gm.render(scene, spp=1)
    text = str(caught.value)
    assert caught.value.plugin == "glint" and caught.value.path == noise_pyramid.path
    assert "mesh" in text
    assert "no texture coordinates" in text
    assert noise_pyramid.path in text


def test_rays_without_differentials_warn_once(llvm, noise_pyramid):
    """`path` drops differentials: the finest footprint stands for them."""
    scene = make_scene(glint(noise_pyramid), "area", "path")
    with pytest.warns(RuntimeWarning, match="glint_path"):
        first = render(scene, 4)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        render(scene, 4)
    assert np.isfinite(first).all()


@pytest.mark.parametrize("differential", [0.0, 1e-30, np.nan, np.inf, 1e30])
def test_degenerate_differentials(llvm, noise_pyramid, differential):
    bsdf = mi.load_dict(glint(noise_pyramid))
    si = dr.zeros(mi.SurfaceInteraction3f, 2)
    si.wi = [0, 0, 1]
    si.uv = [0.2, 0.3]
    si.duv_dx, si.duv_dy = mi.Vector2f(differential, 0), mi.Vector2f(0, differential)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        value, pdf = bsdf.eval_pdf(mi.BSDFContext(), si, mi.Vector3f(0, 0, 1))
        drawn, weight = bsdf.sample(mi.BSDFContext(), si, 0.5, mi.Point2f(0.3, 0.7))
    for answer in (value, pdf, drawn.pdf, weight):
        assert np.isfinite(np.array(answer)).all()


def test_an_asset_that_is_replaced(any_variant, noise_pyramid, tmp_path):
    """Between two renderings; the same check runs during one."""
    path = tmp_path / "map.glint"
    shutil.copy(noise_pyramid.path, path)
    scene = make_scene({"type": "glint", "asset": str(path), "material": "none", "sigma": 4.0}, "constant", "direct", size=4)
    render(scene, 1)
    other = tmp_path / "other.glint"
    shutil.copy(noise_pyramid.path, other)
    os.utime(other, ns=(1, 1))
    os.replace(other, path)
    watched_file(scene)._next = 0  # do not wait for the next look
    with pytest.raises(Exception) as caught:
        render(scene, 1)
    assert "was replaced" in message_of(caught.value)
    assert str(path) in message_of(caught.value)


def watched_file(scene):
    """The file of the asset that the BSDF of the first shape asks."""
    return scene.shapes()[0].bsdf().layers.facets._files[0]
