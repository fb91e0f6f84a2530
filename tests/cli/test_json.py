"""The schemas of docs/json describe exactly what the tools print with --json and --progress json."""

import copy
import json
import os
import pathlib
import re
import shutil
import struct
import subprocess
import sys

import h5py
import jsonschema
import pytest
from conftest import BIN

ROOT = pathlib.Path(__file__).parents[2]
FOLDER = ROOT / "docs/json"
TOOLS = sorted(path.parent.name for path in (ROOT / "apps").glob("glint-*/main.cpp"))
SCHEMAS = {
    path.name.removesuffix(".schema.json"): json.loads(path.read_text()) for path in sorted(FOLDER.glob("*.schema.json"))
}

LIGHTS = {"lights": [{"type": "sphere", "centre": [1, 0, 3], "radius": 0.5, "radiance": [3, 2, 1]}]}
# A map this small, asked at one size.
SCENE = {
    "schema": "glint-plan scene 1",
    "lights": [{"type": "environment", "band_limit_deg": 60}],
    "materials": [{"map": "n.png", "footprints": {"smallest_texels": 4, "largest_texels": 4}, "sigma_r": 0.1, "tolerance": 9}],
}
QUERIES = {"half.csv": "u,v,sigma,hx,hy\n.3,.3,4,0,0\n.1,.2,5,.1,0\n", "displaced.csv": "u,v,level,hx,hy\n.3,.3,0,0,0\n"}
ASSETS = (
    "kept",
    "kept.cp",
    "normals",
    "smooth",
    "heights",
    "flat",
    "damaged",
    "pyramid",
    "shard",
    "cp",
    "tucker",
    "pca",
    "bins",
    "range",
    "sat",
    "moments",
    "tiny",
    "wang",
    "wangpyramid",
    "wangcp",
    "wave",
    "wavecp",
    "lobes",
    "zonal",
    "light",
    "displaced",
    "rough",
    "colored",
    "measured",
)

# Commands in the order that they run: each may read what the commands before it wrote.
MAKE = [
    "synth flakes --size 32 -o n.exr",
    "synth weave --size 32 -o h.exr --height",
    "synth flat --size 16 -o flat.exr --height",
    "synth flake2d --size 32 --flake-size-uv .125 --roughness .4 --coverage .7 --presence -o presence.exr",
    "synth isotropic --size 32 -o n.png --bits 16",
    "ingest n.exr -o normals.glint",
    "ingest n.png -o smooth.glint --texel-size-um 5",
    "ingest h.exr --kind height --to heights -o heights.glint",
    "ingest flat.exr --kind height --to heights --allow-constant -o flat.glint",
    "pyramid normals.glint -o pyramid.glint --resolution 64 --stride 8 --sigma-r .02",
    "pyramid smooth.glint -o p2.glint --resolution 32 --stride 16 --surface smooth --boundary clamp --precision float --sigma-r .03",
    "pyramid normals.glint -o shard.glint --resolution 64 --stride 8 --sigma-r .02 --keep-normals i16 --region 1/2",
    "pyramid normals.glint -o second.glint --resolution 64 --stride 8 --sigma-r .02 --keep-normals i16 --region 2/2",
    "merge second.glint shard.glint -o joined.glint",
    "compress pyramid.glint -o cp.glint --method cp --rank 8",
    "compress pyramid.glint -o tucker.glint --method tucker --tolerance .2",
    "compress pyramid.glint -o pca.glint --method pca --rank 4 --quantize f32",
    "pyramid normals.glint -o kept.glint --resolution 64 --stride 8 --sigma-r .02 --keep-normals i16",
    "compress kept.glint -o kept.cp.glint --method cp --rank 4",
    "binmap normals.glint -o bins.glint --alpha .05",
    "binmap normals.glint -o range.glint --alpha .02:.1",
    "sat normals.glint -o sat.glint --bins 6x20",
    "moments normals.glint -o moments.glint",
    "moments heights.glint -o m.glint --finest 0 --roughness .3 --textures . --lobe gltf",
    "tiny normals.glint -o tiny.glint --cut 8 --at 3 4 --mode scattered --resolution 32 --sigma-r .03",
    "tiny normals.glint -o t.glint --cut 16 --resolution 32 --sigma-r .03",
    "tiny tiny.glint -o plane.glint --explicit 24 16 --origin -100 7 --per-texel 2",
    "wang normals.glint -o wang.glint --size 16",
    "wang wang.glint --explicit 20 10 -o part.glint",
    "pyramid wang.glint -o wangpyramid.glint --resolution 64 --stride 8 --sigma-r .02",
    "compress wangpyramid.glint -o wangcp.glint --method cp --rank 4",
    "synth grating --size 64 --height --texel-size-um 1 --depth-um .2 -o g.exr",
    "ingest g.exr --kind height --to heights --height-scale-um 1 --texel-size-um 1 -o grating.glint",
    "pyramid grating.glint -o wave.glint --optics wave --coherence-um 4 --wavelengths 3 --resolution 64 --stride 8",
    "compress wave.glint -o wavecp.glint --tolerance .2",
    "shlobes -o lobes.glint --sigma-r .1 --order 6 --grid 5x8 --precision f32",
    "shlobes -o zonal.glint --sigma-r .1 --order 6 --grid none",
    "shlobes --light lights.json -o light.glint --order 6 --grid 5x8 --gaussians 2",
    "bench normals.glint -o bench.json --quick --only moments,histograms",
    "bench --stability -o stability.json --quick --only one-direction",
    "bench --preset xing2024 -o paper.json --quick",
    "plan scene.json -o plan.json --make plan.mk",
    "plan scene.json --explain",
    "plan --check plan.json --sweep --paper",
    "displace heights.glint -o displaced.glint --factors 4,16 --angular 3 --spatial 2",
    "displace heights.glint -o rough.glint --base ggx:.3:1,2 --factor 8 --angular 3 --spatial 2",
    "displace heights.glint -o colored.glint --base-color n.png --factor 8 --angular 3 --spatial 2",
    "displace flat.glint -o level.glint --factor 8 --angular 3 --spatial 2",
    "displace heights.glint -o measured.glint --base-table grey.binary --factor 8 --angular 3 --spatial 2",
    "pyramid normals.glint -o pyramid.glint --resolution 64 --stride 8 --sigma-r .02 --skip-unchanged",
    "ingest tile.<UDIM>.exr -o tile.<UDIM>.glint",
    "farm plan --from plan.json -o farm.json",
    "farm run farm.json",
    "farm status farm.json",
    "farm plan broken -o broken.json --make pyramid",
]
QUERY = "query {asset}.glint --uv .3 .6 --sigma 4 {asked}"
ASKED = [
    *(
        QUERY.format(asset=asset, asked="--half 0 .1")
        for asset in ("normals", "pyramid", "cp", "bins", "sat", "moments", "tiny", "wave", "wavecp", "reflectance displaced")
    ),
    *(QUERY.format(asset=asset, asked="--half .1 0 --repeat 15") for asset in ("pyramid", "reflectance displaced")),
    *(QUERY.format(asset=asset, asked="--image ndf.png --image-size 16") for asset in ("tucker", "reflectance displaced")),
    *(QUERY.format(asset=asset, asked="--range -1 -1 1 1 --repeat 15") for asset in ("normals", "sat")),
    "query normals.glint --uv .3 .6 --box 3 0 0 2 --range -1 -1 1 1",
    "query pyramid.glint --uv .3 .6 --cov 16 0 20 --half 0 0",
    QUERY.format(asset="cp", asked="--samples 3 -o samples.csv"),
    "query pyramid.glint --csv half.csv -o answers.csv",
    *(QUERY.format(asset=asset, asked="--light light.glint --wo .1 0 1") for asset in ("light normals", "light sat")),
    "query reflectance displaced.glint --uv .3 .6 --level 1 --wi .5 0 1 --wo -.2 0 1",
    "query reflectance colored.glint --uv .3 .6 --sigma 3 --wi .5 0 1 --wo -.2 0 1 --repeat 15",
    "query reflectance displaced.glint --uv .3 .6 --level 0 --wo 0 0 1 --samples 3 -o samples.csv",
    "query plane wang.glint --texel 1e12 -3.5 --sigma 4 --half 0 .1",
    "query reflectance displaced.glint --csv displaced.csv -o answers.csv",
]
FOUND = [*(f"info {asset}.glint" for asset in (*ASSETS, "tile.1001", "tile.<UDIM>")), "validate normals.glint pyramid.glint"]
REFUSED = [
    "farm run broken.json",
    "validate damaged.glint lights.json normals.glint",
    "validate missing.glint",
    *(f"{tool.removeprefix('glint-')} --nonsense" for tool in TOOLS),
]
PROGRESS = "pyramid normals.glint -o pyramid.glint --resolution 64 --stride 8 --force --progress json"


def run(folder, command):
    program, *arguments = command.split()
    return subprocess.run([BIN / f"glint-{program}", *arguments], cwd=folder, capture_output=True, text=True, timeout=60)


@pytest.fixture(scope="module")
def documents(tmp_path_factory):
    """[(schema, command, document)] of every command, and of the lines of progress."""
    folder = tmp_path_factory.mktemp("json")
    (folder / "lights.json").write_text(json.dumps(LIGHTS))
    # The same reflectance in all bins, in units of MERL's channels.
    grey = [0.2 * scale for scale in (1500, 1500 / 1.15, 1500 / 1.66) for _ in range(8 * 8 * 8)]
    (folder / "grey.binary").write_bytes(struct.pack(f"<3i{len(grey)}d", 8, 8, 8, *grey))
    (folder / "scene.json").write_text(json.dumps(SCENE))
    for name, text in QUERIES.items():
        (folder / name).write_text(text)
    (folder / "broken").mkdir()
    (folder / "broken/image.png").write_text("no image")
    found = []
    for command in MAKE + ASKED + FOUND + REFUSED:
        process = run(folder, command + " --json")
        assert (process.returncode == 0) == (command not in REFUSED), f"{command}\n{process.stderr}"
        found.append(("glint-" + command.split()[0], command, json.loads(process.stdout)))
        if command == MAKE[0]:
            for tile in (1001, 1002):
                shutil.copy(folder / "n.exr", folder / f"tile.{tile}.exr")
        if command == MAKE[-1]:
            shutil.copy(folder / "heights.glint", folder / "damaged.glint")
            with h5py.File(folder / "damaged.glint", "r+") as file:
                file["heights"][...] = float("nan")
    lines = run(folder, PROGRESS).stderr.splitlines()
    assert lines
    return found + [("progress", PROGRESS, json.loads(line)) for line in lines]


def validator(name, schemas=SCHEMAS):
    """Checks documents against a schema, with references to other files."""
    address = {other: f"{FOLDER.as_uri()}/{other}.schema.json" for other in schemas}
    store = {address[other]: schema for other, schema in schemas.items()}
    resolver = jsonschema.RefResolver(address[name], schemas[name], store=store)
    return jsonschema.Draft202012Validator(schemas[name], resolver=resolver)


def nodes(schema, path=()):
    """(path, node) of every object and list within a schema."""
    yield path, schema
    for key, value in schema.items() if isinstance(schema, dict) else enumerate(schema):
        if isinstance(value, (dict, list)):
            yield from nodes(value, (*path, key))


def closed_objects(schema):
    return [(path, node) for path, node in nodes(schema) if isinstance(node, dict) and "additionalProperties" in node]


def test_every_tool_has_a_schema():
    assert set(SCHEMAS) == {*TOOLS, "common", "properties", "progress"}


@pytest.mark.parametrize("name", SCHEMAS)
def test_schema_is_valid_closed_and_described(name):
    jsonschema.Draft202012Validator.check_schema(SCHEMAS[name])
    for path, node in nodes(SCHEMAS[name]):
        if isinstance(node, dict) and node.get("type") == "object" and "properties" in node:
            assert node.get("additionalProperties") is False, path
    for path, node in closed_objects(SCHEMAS[name]):
        for key, value in node["properties"].items():
            assert value.get("description", "").endswith("."), (*path, key)


def test_documents_are_as_described(documents):
    problems = [
        f"{command}: {error.message} at {list(error.absolute_path)}"
        for name, command, document in documents
        for error in validator(name).iter_errors(document)
    ]
    assert problems == []


def test_every_kind_is_asked(documents):
    results = [document["result"] for name, _, document in documents if name == "glint-info" and "result" in document]
    kinds = {result["kind"] for result in results if "kind" in result}
    assert kinds == {kind["kind"] for kind in json.loads((ROOT / "formats/schema.json").read_text())["kinds"]}


@pytest.mark.parametrize("name", SCHEMAS)
def test_a_property_that_a_schema_lacks_is_found(documents, name):
    """Each property is in some document, and without it in the schema that document is refused."""
    reader = {"properties": "glint-info"}.get(name, name)
    asked = [(schema, document) for schema, _, document in documents if name == "common" or schema == reader]
    for path, node in closed_objects(SCHEMAS[name]):
        for key in node["properties"]:
            schemas = SCHEMAS | {name: copy.deepcopy(SCHEMAS[name])}
            changed = schemas[name]
            for step in path:
                changed = changed[step]
            del changed["properties"][key]
            changed["required"] = [other for other in changed.get("required", []) if other != key]
            checks = {schema: validator(schema, schemas) for schema in {schema for schema, _ in asked}}
            assert not all(checks[schema].is_valid(document) for schema, document in asked), (*path, key)


def test_properties_are_those_of_the_format():
    process = subprocess.run([sys.executable, FOLDER / "properties.py", "--check"], capture_output=True, text=True, timeout=60)
    assert (process.returncode, process.stderr) == (0, "")


def test_other_properties_are_found(tmp_path):
    schema = json.loads((ROOT / "formats/schema.json").read_text())
    schema["kinds"][0]["attributes"].pop()
    (tmp_path / "schema.json").write_text(json.dumps(schema))
    process = subprocess.run(
        [sys.executable, FOLDER / "properties.py", "--check", "--schema", tmp_path / "schema.json"],
        capture_output=True,
        timeout=60,
    )
    assert process.returncode == 1


def test_commands_of_the_readme_check_a_result(tmp_path):
    commands = re.search(r"^```sh\n(.*?)^```", (FOLDER / "README.md").read_text(), re.MULTILINE | re.DOTALL)[1]
    environment = os.environ | {"PATH": f"{BIN}:/usr/bin:{os.environ['PATH']}", "SCHEMAS": str(FOLDER)}
    process = subprocess.run(["sh", "-ec", commands], cwd=tmp_path, env=environment, capture_output=True, text=True, timeout=60)
    assert (process.returncode, process.stdout) == (0, ""), process.stderr
