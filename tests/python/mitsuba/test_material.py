"""Descriptions of materials."""

import json

import jsonschema
import mitsuba as mi
import numpy as np
import pytest
from conftest import make_scene, render

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


def test_every_parameter_of_a_description_is_known_to_the_plugin(llvm, write, noise_pyramid):
    """Options of kinds that the asset is not of are refused by the library, not as unknown parameters."""
    everything = changed(
        asset={"file": "flakes.glint", "sigma_r": 0.02, "surface": "flat", "boundary": "wrap", "interpolation": "trilinear", "pixels": "constant"},
        optics={"material": "Au", "specular_reflectance": 0.9, "facets": "distribution"},
        layers={"coat": {"ior": 1.5, "asset": {"file": "flakes.glint"}, "placement": {"uv_scale": 3}}},
    )
    bsdf = mi.load_dict({**material.load(write(everything)), "sigma": 5.0})
    assert np.isfinite(render(make_scene(bsdf, "constant", "direct", size=4), 4)).all()
