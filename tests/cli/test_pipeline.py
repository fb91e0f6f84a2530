"""pipelines/glint.mk: images become assets, and only what changed is made again."""

import os
import pathlib
import shutil
import subprocess

import pytest
from conftest import BIN

ROOT = pathlib.Path(__file__).parents[2]
MAKEFILE = """
GLINT_BIN := {bin}
GLINT_MAPS := maps
GLINT_OUT := assets
GLINT_PYRAMID_FLAGS := --resolution 64 --sigma-r 0.02
GLINT_INGEST_FLAGS_dunes := --kind height
GLINT_WANG_FLAGS := --size 64
GLINT_DISPLACE_FLAGS := --factors 16,64 --angular 5
GLINT_HEIGHTS_FLAGS_dunes := --texel-size-um 1
GLINT_WAVE_FLAGS := --wavelengths 2 --resolution 64 --stride 64
all: $(foreach method,cp tucker pca binmap sat moments tiny wang,assets/flakes.$(method).glint) assets/dunes.pca.glint assets/dunes.displaced.glint assets/dunes.wavecp.glint
include {root}/pipelines/glint.mk
"""


@pytest.fixture
def project(tmp_path):
    (tmp_path / "maps").mkdir()
    shutil.copy(ROOT / "data-samples/flakes_256.png", tmp_path / "maps/flakes.png")
    shutil.copy(ROOT / "data-samples/isotropic_height_256.exr", tmp_path / "maps/dunes.exr")
    (tmp_path / "Makefile").write_text(MAKEFILE.format(bin=BIN, root=ROOT))

    def make(*arguments):
        process = subprocess.run(
            ["make", *arguments],
            cwd=tmp_path,
            capture_output=True,
            text=True,
            timeout=250,
            env={key: value for key, value in os.environ.items() if not key.startswith("MAKE")},
        )
        assert process.returncode == 0, process.stdout + process.stderr
        return process.stdout

    make.folder = tmp_path
    return make


def tools(output):
    return sorted(
        pathlib.Path(line.split()[0].strip("'")).name
        for line in output.splitlines()
        if line.split()[0].strip("'").startswith(str(BIN))
    )


def later(path):
    """Marks a file as changed, without waiting for the clock."""
    newest = max(p.stat().st_mtime for p in path.parents[1].rglob("*"))
    os.utime(path, (newest + 2, newest + 2))


def test_images_become_assets_and_only_changes_are_made_again(project):
    first = tools(project("-j2"))
    assert first == ["glint-binmap"] + ["glint-compress"] * 5 + ["glint-displace"] + ["glint-ingest"] * 3 + [
        "glint-moments"
    ] + ["glint-pyramid"] * 3 + ["glint-sat", "glint-tiny", "glint-wang"]
    made = {p.name for p in (project.folder / "assets").glob("*.glint")}
    assert made == {
        f"{n}.glint"
        for n in (
            "flakes",
            "flakes.pyramid",
            "flakes.cp",
            "flakes.tucker",
            "flakes.pca",
            "flakes.binmap",
            "flakes.sat",
            "flakes.moments",
            "flakes.tiny",
            "flakes.wang",
            "dunes",
            "dunes.pyramid",
            "dunes.pca",
            "dunes.heights",
            "dunes.displaced",
            "dunes.wave",
            "dunes.wavecp",
        )
    }
    assert subprocess.run([BIN / "glint-validate", *(project.folder / "assets").glob("*.glint")]).returncode == 0

    assert tools(project("-j2")) == []

    later(project.folder / "maps/dunes.exr")
    assert tools(project("-j2")) == [
        "glint-compress",
        "glint-compress",
        "glint-displace",
        "glint-ingest",
        "glint-ingest",
        "glint-pyramid",
        "glint-pyramid",
    ]

    later(project.folder / "Makefile")
    assert tools(project("--dry-run")) == first


# Names of people's images. Those of the second row end a name for ninja up to 1.11.
NAMES = ["two words", "100%", "brick (1)", "$cheap", "C#", "a:b", "back\\slash", "[x]", "~tilde", "{x},y!@+"]
NAMES_FOR_MAKE = ["salt & pepper", "rock 'n' roll", 'say "hi"', "star*", "why?", "<x>", "`tick`", "x^2"]


def test_pyramids_in_parts_are_the_same_and_parts_are_deleted(project):
    target = "assets/flakes.pyramid.glint"
    project(target)
    whole = (project.folder / target).read_bytes()
    (project.folder / target).unlink()
    assert tools(project("-j2", target, "GLINT_SHARDS=3")) == ["glint-merge"] + ["glint-pyramid"] * 3
    assert (project.folder / target).read_bytes() == whole
    assert {p.name for p in (project.folder / "assets").glob("*.glint")} == {"flakes.glint", "flakes.pyramid.glint"}
    assert tools(project(target, "GLINT_SHARDS=3")) == [], "parts that Make deleted are not made again"


def make_name(name):
    """A name as a Makefile holds it."""
    for sign, escaped in (("$", "$$"), (" ", "\\ "), ("#", "\\#"), (":", "\\:")):
        name = name.replace(sign, escaped)
    return name


class Folder:
    """A folder with a Makefile that includes glint.mk."""

    def __init__(self, path):
        self.path = path
        (path / "maps").mkdir()

    def image(self, name, pattern="flakes", size="16"):
        subprocess.run([BIN / "glint-synth", pattern, "--size", size, "-o", self.path / "maps" / name, "--force"], check=True)

    def write(self, targets, *lines):
        text = [
            "GLINT_MAPS := maps",
            "GLINT_OUT := assets",
            f"GLINT_BIN := {BIN}",
            *lines,
            f"include {ROOT}/pipelines/glint.mk",
            f"all: {targets}",
        ]
        (self.path / "Makefile").write_text("\n".join(text) + "\n")

    def make(self, *arguments):
        environment = {key: value for key, value in os.environ.items() if not key.startswith("MAKE")}
        return subprocess.run(
            ["make", *arguments, "all"], cwd=self.path, capture_output=True, text=True, timeout=250, env=environment
        )

    def made(self):
        process = self.make("-j2")
        assert process.returncode == 0, process.stdout + process.stderr
        return tools(process.stdout)

    def assets(self):
        return {path.name.removesuffix(".glint") for path in (self.path / "assets").glob("*.glint")}


@pytest.fixture
def folder(tmp_path):
    return Folder(tmp_path)


def test_names_may_hold_blanks_and_signs(folder):
    names = NAMES + NAMES_FOR_MAKE
    for name in names:
        folder.image(f"{name}.png")
    folder.write(" ".join(f"assets/{make_name(name)}.sat.glint" for name in names))
    assert folder.made() == ["glint-ingest"] * len(names) + ["glint-sat"] * len(names)
    assert folder.assets() == {f"{name}{kind}" for name in names for kind in ("", ".sat")}
    assert folder.made() == []
    for name in names:
        os.utime(folder.path / "maps" / f"{name}.png")
        assert folder.made() == ["glint-ingest", "glint-sat"], name


def test_depfiles_of_odd_names_are_included(folder):
    """What only a depfile names makes an asset again: here the file of settings, which is no prerequisite of the rules."""
    names = NAMES + NAMES_FOR_MAKE
    for name in names:
        folder.image(f"{name}.png")
        (folder.path / f"{name}.toml").write_text("texel-size-um = 2\n")
    folder.write(
        " ".join(f"assets/{make_name(name)}.glint" for name in names),
        "GLINT_SETTINGS :=",
        "GLINT_INGEST_FLAGS = --config $(call glint_quote,$*.toml)",
    )
    assert folder.made() == ["glint-ingest"] * len(names)
    assert folder.made() == []
    for name in names:
        os.utime(folder.path / f"{name}.toml")
        assert folder.made() == ["glint-ingest"], name


def test_all_images_of_a_folder_have_assets(folder):
    names = ["plain", "two words", "C#", "a:b", "$x", "100%", "[x]"]
    for name in names:
        folder.image(f"{name}.png")
    folder.write("$(call glint_all,sat)")
    assert folder.made() == ["glint-ingest"] * len(names) + ["glint-sat"] * len(names)
    assert folder.assets() == {f"{name}{kind}" for name in names for kind in ("", ".sat")}


@pytest.mark.parametrize("name", ["a;b", "a|b", "a=b"])
def test_names_that_make_cannot_hold_are_an_error_that_names_the_image(folder, name):
    folder.image(f"{name}.png")
    folder.write("$(call glint_all)")
    process = folder.make()
    assert process.returncode == 2
    assert f"maps/{name}: targets of Make cannot have names" in process.stderr
    process = subprocess.run(
        [BIN / "glint-ingest", f"maps/{name}.png", "-o", "a.glint", "--depfile", "a.d"],
        cwd=folder.path,
        capture_output=True,
        text=True,
    )
    assert process.returncode == 1
    assert f"maps/{name}.png: a name with '{name[1]}' cannot stand in a depfile" in process.stderr


@pytest.mark.parametrize("name", ["my assets", "a,b", "o'x", "a&b", "a(b)", "o%d", "a=b", "a:b", "o;x"])
def test_folders_that_make_cannot_hold_are_an_error_that_names_them(folder, name):
    folder.write("assets/x.glint", f"GLINT_OUT := {name}")
    process = folder.make()
    assert process.returncode == 2
    assert f'GLINT_OUT is "{name}"' in process.stderr


@pytest.mark.parametrize("name", ["wood", "old wood"])
@pytest.mark.parametrize("before, after", [("png", "tif"), ("tif", "png"), ("png", "exr")])
def test_an_image_may_be_replaced_by_one_of_another_type(folder, name, before, after):
    folder.image(f"{name}.{before}")
    folder.write(f"assets/{make_name(name)}.glint assets/{make_name(name)}.sat.glint")
    assert folder.made() == ["glint-ingest", "glint-sat"]
    (folder.path / "maps" / f"{name}.{before}").unlink()
    folder.image(f"{name}.{after}", "scratches")
    assert folder.made() == ["glint-ingest", "glint-sat"]
    assert (
        f"{name}.{after}"
        in subprocess.run([BIN / "glint-info", folder.path / "assets" / f"{name}.glint"], capture_output=True, text=True).stdout
    )
    assert folder.made() == []


@pytest.mark.parametrize("first, second", [("png", "exr"), ("exr", "tif"), ("PNG", "png")])
def test_two_images_of_one_name_are_an_error(folder, first, second):
    folder.image(f"old wood.{first}")
    folder.image(f"stone.{first}")
    targets = "assets/old\\ wood.glint assets/stone.glint"
    folder.write(targets)
    assert folder.made() == ["glint-ingest"] * 2
    folder.image(f"old wood.{second}")
    os.utime(folder.path / "maps" / f"old wood.{second}", (0, 0))  # older than the asset: nothing but the name tells
    process = folder.make()
    assert process.returncode == 2
    assert f"maps/old wood.{first}" in process.stderr and f"maps/old wood.{second}" in process.stderr
    shutil.rmtree(folder.path / "assets")
    assert folder.make().returncode == 2
    folder.write(targets, f"GLINT_IMAGES := {first}")
    assert folder.made() == ["glint-ingest"] * 2


@pytest.mark.parametrize("ending", "pyramid cp tucker pca binmap sat moments tiny wang heights displaced wave wavecp light".split())
def test_an_image_named_as_an_asset_of_another_image_is_an_error(folder, ending):
    """old wood.sat.glint would be the histograms of "old wood", or the normals of "old wood.sat"."""
    folder.image("old wood.png")
    folder.image(f"old wood.{ending}.png")
    folder.write(f"assets/old\\ wood.{ending}.glint")
    process = folder.make()
    assert process.returncode == 2
    assert "maps/old wood and maps/" in process.stderr and "rename one of them" in process.stderr
    (folder.path / "maps/old wood.png").unlink()
    assert folder.made() == ["glint-ingest"]


def test_an_image_named_as_lobes_is_an_error(folder):
    """Lobes come from a number, so that the image would never be read."""
    folder.image("a.lobes.png")
    folder.write("assets/a.lobes.glint")
    process = folder.make()
    assert process.returncode == 2 and "maps/a.lobes" in process.stderr and "rename it" in process.stderr


def test_types_may_be_in_capitals(folder):
    folder.image("a.png")
    (folder.path / "maps/a.png").rename(folder.path / "maps/a.PNG")
    folder.image("b.tif")
    (folder.path / "maps/b.tif").rename(folder.path / "maps/b.TIF")
    folder.write("$(call glint_all)")
    assert folder.made() == ["glint-ingest"] * 2


def test_light_and_lobes_have_rules(folder):
    import numpy
    import OpenImageIO as oiio

    image = oiio.ImageOutput.create(str(folder.path / "maps/studio.exr"))
    image.open(str(folder.path / "maps/studio.exr"), oiio.ImageSpec(32, 16, 3, "float"))
    image.write_image(numpy.ones((16, 32, 3), numpy.float32))
    image.close()
    (folder.path / "maps/desk.json").write_text(
        '{"lights": [{"type": "sphere", "centre": [0, 0, 5], "radius": 1, "radiance": [1, 1, 1]}]}'
    )
    folder.write(
        "assets/studio.light.glint assets/desk.light.glint assets/rough.lobes.glint",
        "GLINT_LIGHT_FLAGS := --order 4 --grid 3x4",
        "GLINT_LOBES_FLAGS_rough := --sigma-r 0.1 --order 8 --grid none",
    )
    assert folder.made() == ["glint-shlobes"] * 3
    assert folder.made() == []
    os.utime(folder.path / "maps/desk.json")
    assert folder.made() == ["glint-shlobes"]
    validate = subprocess.run(
        [BIN / "glint-validate", *(folder.path / "assets").glob("*.glint")], capture_output=True, text=True
    )
    assert validate.returncode == 0, validate.stdout


def test_an_image_that_a_rule_makes_is_read(folder):
    folder.write("assets/noise.glint", "maps/noise.exr:", f"\t{BIN}/glint-synth isotropic --size 16 -o $@")
    assert folder.made() == ["glint-ingest", "glint-synth"]
    assert folder.made() == []


@pytest.mark.skipif(shutil.which("ninja") is None, reason="ninja is not installed")
@pytest.mark.parametrize("deps", ["  deps = gcc\n", ""], ids=["deps", "depfile"])
def test_ninja_reads_depfiles(folder, deps):
    rule = f"rule ingest\n  command = {BIN}/glint-ingest $image -o $out --depfile $out.d\n  depfile = $out.d\n{deps}"
    statements = []
    for k, name in enumerate(NAMES):
        folder.image(f"{name}.png")
        quoted = "'" + f"maps/{name}.png".replace("$", "$$") + "'"
        statements.append(f"build {k}.glint: ingest\n  image = {quoted}\n")
    (folder.path / "build.ninja").write_text(rule + "".join(statements))

    def run():
        process = subprocess.run(["ninja"], cwd=folder.path, capture_output=True, text=True)
        assert process.returncode == 0, process.stdout + process.stderr
        return process.stdout

    run()
    assert "no work to do" in run()
    for k, name in enumerate(NAMES):
        os.utime(folder.path / "maps" / f"{name}.png")
        assert f"-o {k}.glint" in run(), name
        assert "no work to do" in run(), name
