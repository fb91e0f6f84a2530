"""pipelines/mitsuba_scene.py: what a scene of Mitsuba asks, as a scene of glint-plan."""

import json
import pathlib
import subprocess
import sys

import numpy as np
import pytest

ROOT = pathlib.Path(__file__).parents[3]
sys.path[:0] = [str(ROOT / "pipelines/scenes"), str(ROOT / "pipelines")]
import mitsuba_scene  # noqa: E402
import shapes  # noqa: E402

SIDE, UV_OF_A_UNIT, COPIES_OF_A_UV = 10.0, 2.0, 0.5
# A map covers 1 / COPIES_OF_A_UV of uv, which are so many units.
MAP_SIZE = 1 / COPIES_OF_A_UV / UV_OF_A_UNIT
NEARLY = 1e-4  # single precision of meshes

XML = """<scene version="3.0.0">
  <sensor type="perspective"><float name="fov" value="40"/>
    <transform name="to_world"><translate z="-30"/></transform>
    <film type="hdrfilm"><integer name="width" value="800"/><integer name="height" value="600"/></film>
    <sampler type="independent"><integer name="sample_count" value="16"/></sampler></sensor>
  <bsdf type="glint" id="paint"><string name="asset" value="{asset}"/><float name="sigma_r" value="0.02"/><float name="uv_scale" value="0.5"/></bsdf>
  <shape type="ply" id="panel"><string name="filename" value="quad.ply"/><ref id="paint"/></shape>
  <emitter type="point"><point name="position" x="0" y="0" z="-30"/></emitter>
</scene>"""


def dictionary(distance, asset, **film):
    place = np.eye(4)
    place[2, 3] = -distance
    return {
        "type": "scene",
        "camera": {
            "type": "perspective",
            "fov": 40,
            "to_world": place.tolist(),
            "film": {"type": "hdrfilm", "width": 800, "height": 600, **film},
            "sampler": {"type": "independent", "sample_count": 16},
        },
        "panel": {
            "type": "ply",
            "filename": "quad.ply",
            "bsdf": {
                "type": "twosided",
                "bsdf": {"type": "glint", "asset": str(asset), "sigma_r": 0.02, "uv_scale": COPIES_OF_A_UV},
            },
        },
        "lamp": {"type": "point", "position": [0, 0, -30]},
    }


@pytest.fixture
def write_scene(tmp_path, run_tool):
    """write_scene(*files) -> (process, scene or None), in a folder with a mesh and a map."""
    run_tool("glint-synth", "flakes", "--size", 64, "-o", tmp_path / "flakes.png")
    run_tool("glint-ingest", tmp_path / "flakes.png", "-o", tmp_path / "flakes.glint")
    x = np.linspace(-SIDE / 2, SIDE / 2, 20)
    points = np.stack(np.broadcast_arrays(x, x[:, None], 0 * x), -1)
    shapes.Mesh().grid(points, UV_OF_A_UNIT * points[..., :2]).write(tmp_path / "quad.ply")
    for distance in 8, 20:
        (tmp_path / f"at{distance}.json").write_text(json.dumps(dictionary(distance, tmp_path / "flakes.glint")))
    (tmp_path / "scene.xml").write_text(XML.format(asset=tmp_path / "flakes.glint"))
    (tmp_path / "plain.json").write_text(json.dumps({"type": "scene", "ball": {"type": "sphere"}}))

    def run(*files):
        command = [sys.executable, ROOT / "pipelines/mitsuba_scene.py", *files, "--tolerance", "0.2", "-o", "out.json"]
        done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True)
        output = tmp_path / "out.json"
        return done, json.loads(output.read_text()) if output.exists() else None

    return run


def check_material(scene):
    (material,) = scene["materials"]
    assert (material["name"], material["map"], material["sigma_r"]) == ("panel", "flakes.glint", 0.02)
    assert material["uv_size"] == pytest.approx(MAP_SIZE, rel=NEARLY)
    assert scene["lights"] == [{"type": "point"}]


def test_frames_of_a_path_give_the_distances(write_scene, run_tool, tmp_path):
    done, scene = write_scene("at20.json", "at8.json")
    assert done.returncode == 0, done.stderr
    assert scene["camera"] == {
        "nearest": pytest.approx(8, rel=NEARLY),
        "farthest": pytest.approx(20, rel=NEARLY),
        "field_of_view_deg": pytest.approx(40, rel=NEARLY),
        "columns": 800,
        "samples_per_pixel": 16,
    }
    check_material(scene)
    scene["unit_m"] = 0.01
    (tmp_path / "out.json").write_text(json.dumps(scene))
    assert "footprints of" in run_tool("glint-plan", tmp_path / "out.json", "--explain"), "glint-plan reads the scene"


def test_a_part_of_a_picture_has_the_pixels_of_the_whole(write_scene, tmp_path):
    part = {"crop_offset_x": 300, "crop_offset_y": 200, "crop_width": 100, "crop_height": 100}
    (tmp_path / "part.json").write_text(json.dumps(dictionary(8, tmp_path / "flakes.glint", **part)))
    done, scene = write_scene("part.json")
    assert done.returncode == 0, done.stderr
    assert (scene["camera"]["columns"], scene["camera"]["field_of_view_deg"]) == (800, pytest.approx(40, rel=NEARLY))


@pytest.mark.parametrize(
    "emitter, light",
    [
        ({"type": "envmap", "filename": "sky.hdr"}, {"type": "environment", "band_limit_deg": 45}),
        ({"type": "constant"}, {"type": "environment", "band_limit_deg": 180}),
        ({"type": "directional"}, {"type": "directional"}),
        ({"type": "spot"}, {"type": "point"}),
    ],
)
def test_lights_are_told_apart(write_scene, tmp_path, emitter, light):
    (tmp_path / "sky.hdr").write_bytes(
        b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 8 +X 16\n" + 8 * 16 * bytes([128, 128, 128, 129])
    )
    scene = dictionary(8, tmp_path / "flakes.glint")
    (tmp_path / "lit.json").write_text(json.dumps(scene | {"lamp": emitter}))
    done, asked = write_scene("lit.json")
    assert done.returncode == 0, done.stderr
    (found,) = asked["lights"]
    assert found["type"] == light["type"]
    assert found.get("band_limit_deg") == light.get("band_limit_deg"), "the columns that Mitsuba repeats are not counted"


def test_columns_of_an_environment_are_those_of_its_image():
    import mitsuba as mi

    mi.set_variant("scalar_rgb")
    for columns, waves in (1024, 512), (15, 7), (3, 1), (2, 1):
        image = mi.Bitmap(np.ones((max(1, columns // 2), columns, 3), np.float32))
        light = mitsuba_scene.light_of(mi.load_dict({"type": "envmap", "bitmap": image}), mi)
        assert light == {"type": "environment", "band_limit_deg": min(180, 360 / waves)}, columns


def test_xml_is_read_too(write_scene):
    done, scene = write_scene("scene.xml")
    assert done.returncode == 0, done.stderr
    assert scene["camera"]["nearest"] == pytest.approx(30, rel=NEARLY)
    check_material(scene)


@pytest.mark.parametrize(
    "arguments, text",
    [
        (["plain.json"], "no mesh has the BSDF glint"),
        (["missing.xml"], "missing.xml: there is no such file"),
        (["broken.json"], "is no JSON"),
        (["broken.xml"], "is no XML"),
        (["behind.json"], "behind the camera"),
        (["rectangle.xml"], "panel: is no mesh"),
        (["bare.xml"], "panel: its mesh has no uv"),
        (["at8.json", "--map", "flakes.png"], "is not ID=FILE"),
    ],
)
def test_bad_input_is_refused(write_scene, tmp_path, arguments, text):
    (tmp_path / "broken.json").write_text("{")
    (tmp_path / "broken.xml").write_text("<scene>")
    (tmp_path / "behind.json").write_text(json.dumps(dictionary(-8, tmp_path / "flakes.glint")))
    scene = XML.format(asset=tmp_path / "flakes.glint")
    (tmp_path / "rectangle.xml").write_text(
        scene.replace('"ply"', '"rectangle"').replace('<string name="filename" value="quad.ply"/>', "")
    )
    (tmp_path / "bare.xml").write_text(scene.replace('"ply"', '"obj"').replace("quad.ply", "bare.obj"))
    (tmp_path / "bare.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    done, scene = write_scene(*arguments)
    assert done.returncode != 0 and scene is None
    assert text in done.stderr.splitlines()[-1] and "Traceback" not in done.stderr


def test_a_map_takes_the_place_of_an_asset(write_scene):
    done, scene = write_scene("at8.json", "--map", "panel=steel.png")
    assert done.returncode == 0, done.stderr
    assert scene["materials"][0]["map"] == "steel.png"
