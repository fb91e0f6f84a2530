"""The definition of glint_bsdf and its example, by MaterialX's own parser, checks and code generator."""

import pathlib
import subprocess

import pytest
from conftest import BIN, PIPELINES

import MaterialX as mx
from MaterialX import PyMaterialXGenGlsl, PyMaterialXGenOsl, PyMaterialXGenShader


@pytest.fixture(scope="module")
def library():
    library = mx.createDocument()
    mx.loadLibraries(mx.getDefaultDataLibraryFolders(), mx.getDefaultDataSearchPath(), library)
    return library


def read(path, library):
    document = mx.createDocument()
    mx.readFromXmlFile(document, str(path))
    document.setDataLibrary(library)
    return document


@pytest.mark.parametrize("name", ["glint_defs.mtlx", "car_paint.mtlx"])
def test_documents_are_valid(library, name):
    valid, message = read(PIPELINES / "materialx" / name, library).validate()
    assert valid, message


def test_the_node_takes_an_asset_and_gives_a_bsdf(library):
    definition = read(PIPELINES / "materialx" / "glint_defs.mtlx", library).getNodeDef("ND_glint_bsdf")
    assert definition.getType() == "BSDF"
    asset = definition.getInput("asset")
    assert asset.getType() == "filename" and asset.getIsUniform()
    # The metal is given as MaterialX's own conductor_bsdf has it, so that one can stand for the other.
    metal = library.getNodeDef("ND_conductor_bsdf")
    for name in ("weight", "ior", "extinction", "normal", "tangent"):
        ours, theirs = definition.getInput(name), metal.getInput(name)
        assert (ours.getType(), ours.getValueString(), ours.getDefaultGeomPropString()) == (
            theirs.getType(),
            theirs.getValueString(),
            theirs.getDefaultGeomPropString(),
        )


@pytest.mark.parametrize(
    "change",
    [
        lambda node: node.setInputValue("file", "a.glint", "filename"),  # an input that the node does not have
        lambda node: node.getInput("asset").setType("string"),
        lambda node: node.setInputValue("roughness", mx.Vector2(0.1, 0.1)),
    ],
)
def test_wrong_inputs_are_not_valid(library, change):
    document = read(PIPELINES / "materialx" / "car_paint.mtlx", library)
    change(document.getNode("flakes"))
    assert not document.validate()[0]


def test_the_asset_is_found_from_the_document(library, car_paint):
    document = read(car_paint / "car_paint.mtlx", library)
    mx.flattenFilenames(document, mx.FileSearchPath(str(car_paint)))
    path = pathlib.Path(document.getNode("flakes").getInputValue("asset"))
    assert path.is_absolute() and path.parent == car_paint
    assert subprocess.run([BIN / "glint-validate", path], capture_output=True).returncode == 0


@pytest.mark.parametrize(
    "generator, call",
    [
        (PyMaterialXGenGlsl.GlslShaderGenerator, "mx_conductor_bsdf("),
        (PyMaterialXGenOsl.OslShaderGenerator, "conductor_bsdf("),
    ],
)
def test_renderers_without_glint_fall_back_to_one_lobe(library, generator, call):
    """Code for them has a conductor of the roughness that the document gives."""
    document = read(PIPELINES / "materialx" / "car_paint.mtlx", library)
    generator = generator.create()
    context = PyMaterialXGenShader.GenContext(generator)
    context.registerSourceCodeSearchPath(mx.getDefaultDataSearchPath())
    (material,) = PyMaterialXGenShader.findRenderableElements(document)
    code = generator.generate("car_paint", material, context).getSourceCode("pixel")
    assert call in code and "0.1225" in code
