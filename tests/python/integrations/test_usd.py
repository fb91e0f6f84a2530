"""The example of USD: its asset is found, packed, and read from the package."""

import subprocess
import zipfile

import pytest
from conftest import BIN, PIPELINES

import MaterialX as mx
from pxr import Ar, Usd, UsdShade, UsdUtils, UsdValidation

FLAKES = "/Square/CarPaint/Flakes"
ALIGNMENT_BYTES = 64  # of every file in a .usdz, so that it can be mapped

# USD's types of values, as MaterialX names them.
TYPES = {"float": "float", "float2": "vector2", "color3f": "color3", "asset": "filename", "token": "BSDF"}


@pytest.fixture
def package(car_paint, tmp_path):
    path = tmp_path / "car_paint.usdz"
    assert UsdUtils.CreateNewUsdzPackage(str(car_paint / "car_paint.usda"), str(path))
    return path


def test_dependency_resolution_finds_the_asset(car_paint):
    layers, assets, missing = UsdUtils.ComputeAllDependencies(str(car_paint / "car_paint.usda"))
    assert [layer.GetDisplayName() for layer in layers] == ["car_paint.usda"]
    assert assets == [str(car_paint / "flakes.pyramid.glint")]
    assert missing == []


def test_a_missing_asset_is_reported(car_paint, tmp_path):
    text = (car_paint / "car_paint.usda").read_text()
    (tmp_path / "car_paint.usda").write_text(text)
    _, assets, missing = UsdUtils.ComputeAllDependencies(str(tmp_path / "car_paint.usda"))
    assert assets == [] and [path.endswith("flakes.pyramid.glint") for path in missing] == [True]


def test_a_package_holds_the_asset_as_it_is(car_paint, package, tmp_path):
    with zipfile.ZipFile(package) as files:
        (entry,) = [info for info in files.infolist() if info.filename.endswith(".glint")]
        assert entry.compress_type == zipfile.ZIP_STORED
        content = files.read(entry)
    whole = package.read_bytes()
    assert content == (car_paint / "flakes.pyramid.glint").read_bytes()
    assert whole.index(content) % ALIGNMENT_BYTES == 0


def test_a_renderer_reads_the_asset_from_the_package(package, tmp_path):
    stage = Usd.Stage.Open(str(package))
    shader = UsdShade.Shader(stage.GetPrimAtPath(FLAKES))
    value = shader.GetInput("asset").Get()
    buffer = Ar.GetResolver().OpenAsset(Ar.ResolvedPath(value.resolvedPath)).GetBuffer()
    (tmp_path / "packed.glint").write_bytes(buffer)
    assert subprocess.run([BIN / "glint-validate", tmp_path / "packed.glint"], capture_output=True).returncode == 0


def test_shaders_are_nodes_of_materialx():
    """Every input is one of the node's, of its type. USD from the registry comes without MaterialX, and cannot check it."""
    library = mx.createDocument()
    mx.loadLibraries(mx.getDefaultDataLibraryFolders(), mx.getDefaultDataSearchPath(), library)
    mx.readFromXmlFile(library, str(PIPELINES / "materialx" / "glint_defs.mtlx"))
    checked = 0
    stage = Usd.Stage.Open(str(PIPELINES / "usd" / "car_paint.usda"))
    for prim in stage.Traverse():
        shader = UsdShade.Shader(prim)
        name = shader.GetShaderId() if shader else None
        if not name or not name.startswith("ND_"):
            continue
        definition = library.getNodeDef(name)
        assert definition, name
        for given in shader.GetInputs():
            declared = definition.getInput(given.GetBaseName())
            assert declared, f"{name} has no input {given.GetBaseName()}"
            assert TYPES[str(given.GetTypeName())] == declared.getType(), given.GetFullName()
            checked += 1
    assert checked >= 10


def test_both_examples_are_the_same_material():
    document = mx.createDocument()
    mx.readFromXmlFile(document, str(PIPELINES / "materialx" / "car_paint.mtlx"))
    stage = Usd.Stage.Open(str(PIPELINES / "usd" / "car_paint.usda"))
    shader = UsdShade.Shader(stage.GetPrimAtPath(FLAKES))
    inputs = {i.getName(): i for i in document.getNode("flakes").getInputs()}
    assert sorted(inputs) == sorted(i.GetBaseName() for i in shader.GetInputs())
    assert inputs["asset"].getValueString() == shader.GetInput("asset").Get().path
    for name in ("ior", "extinction", "uv_scale", "fallback_roughness"):
        value = inputs[name].getValue()
        expected = value if isinstance(value, float) else [value[i] for i in range(len(value))]
        assert shader.GetInput(name).Get() == pytest.approx(expected)


def test_validators_name_nothing_but_nodes_and_the_kind_of_file(package):
    """The validators of USD know neither MaterialX's nodes (they come with a build that has MaterialX) nor .glint."""
    validators = UsdValidation.ValidationRegistry().GetOrLoadAllValidators()
    found = UsdValidation.ValidationContext(validators).Validate(Usd.Stage.Open(str(package)))
    assert {error.GetName() for error in found} == {"MissingShaderIdInRegistry", "UnsupportedFileExtensionInPackage"}
    assert all("ND_" in error.GetMessage() for error in found if error.GetName() == "MissingShaderIdInRegistry")
