"""Descriptions of materials."""

import json

import jsonschema
import mitsuba as mi
import numpy as np
import pytest
from scenes import make_scene, render

from glint_ndf import FileError, InvalidInputError, material

PAINT = {
    "glint_material": 1,
    "name": "red car paint",
    "asset": {"file": "flakes.glint"},
    "placement": {"texels_per_unit": 200, "rotation": 15},
    "optics": {"eta": [1.2, 0.9, 0.6], "k": [7, 6, 5]},
    "layers": {
        "coat": {"ior": 1.5, "alpha": 0.05},
        "transparency": 0.5,
        "base": {"reflectance": [0.4, 0.02, 0.02], "alpha": 0.2},
    },
}


@pytest.fixture
def write(tmp_path, noise_pyramid):
    noise_pyramid.save(tmp_path / "flakes.glint")

    def write(description):
        path = tmp_path / "material.json"
        path.write_text(description if isinstance(description, str) else json.dumps(description))
        return str(path)

    return write


def changed(**members):
    return {name: value for name, value in {**PAINT, **members}.items() if value is not None}


def test_a_description_renders(any_variant, write):
    path = write(PAINT)
    spp = 2 if any_variant.startswith("scalar") else 32
    for bsdf in (material.load(path), {"type": "glint", "description": path}):
        image = render(make_scene(bsdf, "constant", "glint_path", size=8), spp)
        red, green, _ = image.mean(axis=(0, 1))
        assert 0 < green < red < 1


def test_parameters_of_the_scene_have_precedence(llvm, write):
    path = write(PAINT)
    with pytest.raises(Exception, match="rotation"):
        mi.load_dict({"type": "glint", "description": path, "rotation": "x"})


def test_a_scene_can_take_the_alternative_of_a_described_parameter(llvm, write, noise_pyramid):
    """What excludes what the scene gives is dropped from the description."""
    described = write(PAINT)
    scaled = mi.load_dict({"type": "glint", "description": described, "uv_scale": 2.0, "rotation": 0.0})
    assert np.array(scaled.layers.facets.placement.uv(mi.Point2f(0.25, 0.125))).ravel() == pytest.approx([0.5, 0.25])
    mirror = mi.load_dict({"type": "glint", "description": described, "material": "none"})
    assert np.array(mirror.layers.conductor.reflectance(None, mi.Float(0.5), True)).ravel() == pytest.approx([1, 1, 1])
    rough = mi.load_dict({"type": "glint", "description": described, "coat_asset": noise_pyramid.path, "coat_sigma": 4.0})
    assert rough.layers.coat.layer is not None

    with_normals = write(
        changed(layers={"coat": {"ior": 1.5, "asset": {"file": "flakes.glint"}, "placement": {"uv_scale": 3}}})
    )
    assert mi.load_dict({"type": "glint", "description": with_normals, "coat_alpha": 0.2}).layers.coat.layer is None
    assert (
        mi.load_dict({"type": "glint", "description": with_normals, "coat_asset": noise_pyramid.path}).layers.coat.layer
        is not None
    )
    assert (
        mi.load_dict({"type": "glint", "description": with_normals, "coat_texels_per_unit": 50.0}).layers.coat.layer is not None
    )
    named = write(changed(optics={"material": "Au"}))
    assert mi.load_dict({"type": "glint", "description": named, "eta": 1.5, "k": 7.0}).layers.conductor is not None


def test_a_description_lies_beside_the_scene(llvm, write, tmp_path, monkeypatch):
    write(PAINT)
    scene = tmp_path / "scene.xml"
    scene.write_text(
        '<scene version="3.0.0"><shape type="rectangle"><bsdf type="glint"><string name="description" value="material.json"/>'
        "</bsdf></shape></scene>"
    )
    other = tmp_path / "elsewhere"
    other.mkdir()
    monkeypatch.chdir(other)
    assert "flakes.glint" in str(mi.load_file(str(scene)).shapes()[0].bsdf())


def test_a_description_that_is_no_text(llvm):
    with pytest.raises(Exception, match="glint: parameter 'description' must be a text"):
        mi.load_dict({"type": "glint", "description": 3.0})


def test_files_are_relative_to_the_description(llvm, write, tmp_path):
    assert material.load(write(PAINT))["asset"] == str(tmp_path / "flakes.glint")


def test_the_schema_is_one():
    jsonschema.Draft202012Validator.check_schema(material.schema())
    jsonschema.validate(PAINT, material.schema())


BROKEN = [
    (changed(asset=None), "asset"),
    (changed(asset={}), "file"),
    (changed(glint_material=2), "glint_material"),
    (changed(colour="red"), "colour"),
    (changed(placement={"uv_scale": 0}), "uv_scale"),
    (changed(placement={"uv_scale": "2"}), "uv_scale"),
    (changed(optics={"eta": 1.5}), "lacks 'k'"),
    (changed(optics={"eta": [1, 2], "k": 3}), "eta"),
    (changed(layers={"coat": {"alpha": 0.1}}), "ior"),
    (changed(layers={"base": {"reflectance": 0.5}}), "transparency"),
    (changed(layers={"transparency": 1.5, "base": {"reflectance": 0.5}}), "transparency"),
    (changed(layers={"transparency": 0.5, "base": {"reflectance": [0.5, 0.5, 2]}}), "reflectance"),
    (changed(layers={"coat": {"ior": 1.5, "alpha": 0.1, "asset": {"file": "flakes.glint"}}}), "'alpha' and 'asset'"),
    (changed(layers={"coat": {"ior": 1.5, "placement": {"uv_scale": 2}}}), "lacks 'asset'"),
    (changed(placement={"uv_scale": 2, "texels_per_unit": 100}), "'uv_scale' and 'texels_per_unit'"),
    (changed(optics={"material": "Au", "eta": 1, "k": 3}), "'material' and 'eta'"),
    ([], "object"),
]


@pytest.mark.parametrize("description, word", BROKEN)
def test_broken_descriptions_are_refused(write, description, word):
    """By our check, which says where, and by the schema alike."""
    with pytest.raises(InvalidInputError, match=word) as caught:
        material.read(write(description))
    assert "material.json" in str(caught.value)
    with pytest.raises(jsonschema.ValidationError):
        jsonschema.validate(description, material.schema())


def test_files_that_cannot_be_read(llvm, write, tmp_path):
    with pytest.raises(FileError, match="none.json"):
        material.read(tmp_path / "none.json")
    with pytest.raises(InvalidInputError, match="JSON"):
        material.read(write("{"))
    with pytest.raises(Exception, match="none.json"):
        mi.load_dict({"type": "glint", "description": str(tmp_path / "none.json")})


EVERYTHING = [
    {"file": "flakes.glint", "interpolation": "trilinear", "pixels": "constant"},
    {"file": "texels.glint", "sigma_r": 0.02, "surface": "flat", "boundary": "wrap"},
]


@pytest.mark.parametrize("asset", EVERYTHING, ids=["pyramid", "normals"])
def test_every_parameter_of_a_description_is_known_to_the_plugin(llvm, write, noise, tmp_path, asset):
    noise.save(tmp_path / "texels.glint")
    everything = changed(
        asset=asset,
        optics={"material": "Au", "specular_reflectance": 0.9, "facets": "distribution"},
        layers={"coat": {"ior": 1.5, "asset": asset, "placement": {"uv_scale": 3}}},
    )
    bsdf = mi.load_dict({**material.load(write(everything)), "sigma": 5.0, "coat_sigma": 5.0})
    assert np.isfinite(render(make_scene(bsdf, "constant", "direct", size=4), 4)).all()


@pytest.mark.parametrize("prefix", ["", "coat_"])
@pytest.mark.parametrize(
    "option", [{"sigma_r": 0.02}, {"alpha": 0.1}, {"surface": "flat"}, {"boundary": "wrap"}, {"variant": "full"}]
)
def test_options_of_other_kinds_are_refused(llvm, noise_pyramid, prefix, option):
    """The message says which kinds read the option, and of which kind the asset is."""
    (name, value), path = *option.items(), noise_pyramid.path
    coat = {"coat": 1.5, "coat_asset": path} if prefix else {}
    with pytest.raises(Exception, match=f"'{prefix}{name}' .*ndf-pyramid"):
        mi.load_dict({"type": "glint", "asset": path, **coat, prefix + name: value})


def test_options_of_levels_are_refused_without_levels(llvm, noise):
    for option in ({"interpolation": "trilinear"}, {"pixels": "constant"}, {"footprint_parts": 4}, {"normals": noise.path}):
        with pytest.raises(Exception, match="ndf-pyramid, ndf-cp.* is of kind normals"):
            mi.load_dict({"type": "glint", "asset": noise.path, **option})
