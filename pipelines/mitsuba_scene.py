"""Writes the scene of glint-plan from a scene of Mitsuba 3: camera, lights, and the materials with the BSDF `glint`.

    build/venv/bin/python pipelines/mitsuba_scene.py scene.xml --tolerance 0.2 -o scene.json

The scene is an XML file, or JSON with the dictionary of `mitsuba.load_dict`, where a `to_world` is a list of four rows. Several files are the
frames of a camera's path: distances are those of all frames. Maps are the assets that the BSDFs name, which must be of kind normals; --map ID=FILE names another
file for the asset of a shape. The size of a texel follows from the mesh: lengths of edges in the scene over their lengths in uv.
"""

import argparse
import json
import math
import pathlib
import sys
import xml.etree.ElementTree

import numpy as np

SHARP = {"point", "spot", "directional"}
NEAREST_SHARE = 1e-3  # smallest distance over the largest
# Mitsuba repeats the last column of an environment before its first one, and the first one after its last.
REPEATED_COLUMNS = 2


def read_json(path):
    try:
        return json.loads(path.read_text())
    except ValueError as error:
        sys.exit(f"{path}: is no JSON: {error}")


def with_transforms(value, mi):
    """Matrices of JSON, which are lists of four rows, as transforms."""
    if not isinstance(value, dict):
        return value
    return {key: mi.ScalarTransform4f(np.array(v)) if key == "to_world" else with_transforms(v, mi) for key, v in value.items()}


def load(mi, path):
    """Files that a scene names are those of its folder."""
    mi.file_resolver().append(str(path.resolve().parent))
    if path.suffix != ".json":
        return mi.load_file(str(path))
    return mi.load_dict(with_transforms(read_json(path), mi))


def uv_scale_of(mesh, mi):
    """Scene units that a unit of the mesh's uv covers: the median over edges of triangles, weighed alike."""
    params = mi.traverse(mesh)
    points = np.array(params["vertex_positions"]).reshape(-1, 3)
    uv = np.array(params["vertex_texcoords"]).reshape(-1, 2)
    faces = np.array(params["faces"]).reshape(-1, 3)
    if len(uv) == 0:
        return None
    a, b = faces[:, [0, 1, 2]].ravel(), faces[:, [1, 2, 0]].ravel()
    across = np.linalg.norm(uv[a] - uv[b], axis=1)
    used = across > 1e-9
    return float(np.median(np.linalg.norm(points[a] - points[b], axis=1)[used] / across[used])) if used.any() else None


def camera_of(sensor, mi):
    params = mi.traverse(sensor)
    film = sensor.film().size()  # a part of a picture has the pixels of the whole one
    to_world = np.array(sensor.world_transform().matrix).reshape(4, 4)
    return {
        "origin": to_world[:3, 3],
        "axis": to_world[:3, 2],
        "fov": float(np.array(params["x_fov"]).ravel()[0]),
        "columns": int(film[0]),
        "samples": int(sensor.sampler().sample_count()),
    }


def distances(shape, camera):
    """Smallest and largest distance of the corners of a shape's box along the camera's axis; None: all are behind the camera."""
    box = shape.bbox()
    corners = np.array([[(box.min, box.max)[i >> k & 1][k] for k in range(3)] for i in range(8)])
    along = (corners - camera["origin"]) @ camera["axis"]
    farthest = float(along.max())
    # A shape around the camera has no smallest distance, and a plan needs one.
    return (max(float(along.min()), NEAREST_SHARE * farthest), farthest) if farthest > 0 else None


def light_of(emitter, mi):
    kind = emitter.class_().name().lower() if hasattr(emitter, "class_") else emitter.class_name().lower()
    if any(name in kind for name in SHARP):
        return {"type": "directional" if "directional" in kind else "point"}
    if "envmap" in kind or "environmentmap" in kind:
        # Two columns of pixels, which is the finest wave that an image can hold.
        columns = int(mi.traverse(emitter)["data"].shape[1]) - REPEATED_COLUMNS
        return {"type": "environment", "band_limit_deg": min(180.0, 360 / max(1, columns // 2))}
    if "constant" in kind:
        return {"type": "environment", "band_limit_deg": 180}
    return None  # an area light: its shape says how large it looks


def area_light(shape, target):
    """A light as wide as the shape looks from a point."""
    box = shape.bbox()
    centre, size = np.array(box.center()).ravel(), float(np.linalg.norm(np.array(box.extents()).ravel()))
    distance = max(1e-9, float(np.linalg.norm(centre - target)))
    # The diagonal of the box: round lights look a little smaller.
    return {"type": "point", "angular_diameter_deg": min(180.0, 2 * math.degrees(math.atan(size / 2 / distance)))}


def glints_of_dictionary(document):
    """{id of a shape: parameters of its BSDF `glint`}"""

    def inside(value):
        if isinstance(value, dict):
            if value.get("type") == "glint":
                return value
            found = (
                inside(v if not (isinstance(v, dict) and v.get("type") == "ref") else document.get(v["id"]))
                for v in value.values()
            )
            return next((g for g in found if g), None)
        return None

    return {
        name: inside(value)
        for name, value in document.items()
        if isinstance(value, dict) and "filename" in value and inside(value)
    }


def glints_of_xml(path):
    try:
        root = xml.etree.ElementTree.parse(path).getroot()
    except xml.etree.ElementTree.ParseError as error:
        sys.exit(f"{path}: is no XML: {error}")
    named = {bsdf.get("id"): bsdf for bsdf in root.iter("bsdf") if bsdf.get("id")}

    def parameters(element):
        found = next((bsdf for bsdf in element.iter("bsdf") if bsdf.get("type") == "glint"), None)
        refs = (parameters(named[ref.get("id")]) for ref in element.iter("ref") if ref.get("id") in named)
        if found is None:
            return next((p for p in refs if p), None)
        values = {child.get("name"): child.get("value") for child in found}
        return values | {k: float(values[k]) for k in ("uv_scale", "sigma_r") if k in values}

    glints = {shape.get("id"): parameters(shape) for shape in root.iter("shape")}
    if None in {name for name, glint in glints.items() if glint}:
        sys.exit(f"{path}: a shape with the BSDF glint has no id; give it one, which names the material in the plan")
    return {name: glint for name, glint in glints.items() if glint}


def material_of(name, glint, shape, file, tolerance, mi):
    # A rectangle of Mitsuba calls itself a mesh, and has no vertices.
    if not (shape.is_mesh() and "vertex_positions" in mi.traverse(shape)):
        sys.exit(f"{name}: is no mesh, so its uv have no scale; write it as a .ply or .obj")
    if file is None:
        sys.exit(f"{name}: its BSDF names no asset; name a map with --map {name}=FILE")
    scale = uv_scale_of(shape, mi)
    if scale is None:
        sys.exit(f"{name}: its mesh has no uv; add them, because the map is laid out by them")
    material = {"name": name, "map": file, "uv_size": scale / glint.get("uv_scale", 1), "tolerance": tolerance}
    return material | ({"sigma_r": glint["sigma_r"]} if "sigma_r" in glint else {})


def lights_of(scene, target, mi):
    lights = []
    for emitter in scene.emitters():
        light = light_of(emitter, mi)
        if light is None:
            shape = next((s for s in scene.shapes() if s.is_emitter() and s.emitter() == emitter), None)
            light = area_light(shape, target) if shape is not None else {"type": "point"}
        if light not in lights:
            lights.append(light)
    return lights


def plan_scene(scenes, mi, tolerance, unit_m, maps, glints):
    """The scene of glint-plan.

    @param scenes  frames of one scene
    @param maps    {id of a shape: file of its map}, instead of the asset
    @param glints  {id of a shape: parameters of its BSDF `glint`}
    """
    cameras = [camera_of(scene.sensors()[0], mi) for scene in scenes]
    ranges, materials, centres = [], [], []
    for name, glint in glints.items():
        for scene, camera in zip(scenes, cameras):
            shape = next((s for s in scene.shapes() if s.id() == name), None)
            if shape is None:
                sys.exit(f"{name}: no shape has this id; the shapes are {', '.join(s.id() for s in scene.shapes())}")
            ranges.append(distances(shape, camera))
            centres.append(np.array(shape.bbox().center()).ravel())
        file = maps.get(name) or (pathlib.Path(glint["asset"]).name if "asset" in glint else None)
        materials.append(material_of(name, glint, shape, file, tolerance, mi))
    seen = [pair for pair in ranges if pair]
    if not seen:
        sys.exit(
            "all shapes with the BSDF glint are behind the camera; turn the camera, because distances are those in front of it"
        )
    return {
        "schema": "glint-plan scene 1",
        "unit_m": unit_m,
        "camera": {
            "nearest": min(near for near, _ in seen),
            "farthest": max(far for _, far in seen),
            "field_of_view_deg": min(c["fov"] for c in cameras),
            "columns": max(c["columns"] for c in cameras),
            "samples_per_pixel": cameras[0]["samples"],
        },
        "lights": lights_of(scenes[0], np.mean(centres, axis=0), mi),
        "materials": materials,
    }


def main():
    parser = argparse.ArgumentParser(description="Writes the scene of glint-plan from a scene of Mitsuba 3.")
    parser.add_argument(
        "scenes", nargs="+", type=pathlib.Path, help="XML, or JSON with the dictionary of load_dict; several: frames of a path"
    )
    parser.add_argument("-o", "--output", type=pathlib.Path, required=True, help="scene of glint-plan (.json)")
    parser.add_argument("--tolerance", type=float, required=True, help="largest seen error")
    parser.add_argument("--unit-m", type=float, default=1.0, help="metres in a scene unit")
    parser.add_argument(
        "--map", action="append", default=[], metavar="ID=FILE", help="map of the shape with this id, instead of its asset"
    )
    arguments = parser.parse_args()
    for path in arguments.scenes:
        if not path.is_file():
            parser.error(f"{path}: there is no such file; check the name")
    if wrong := [entry for entry in arguments.map if "=" not in entry]:
        parser.error(f"--map {wrong[0]}: is not ID=FILE; give the id of a shape, =, and the file of its map")
    try:
        import mitsuba as mi

        mi.set_variant("scalar_rgb")
        mi.set_variant("llvm_ad_rgb")
        import glint_ndf.mitsuba  # noqa: F401
    except ImportError as error:
        sys.exit(f"{error}; run `make python`, and use build/venv/bin/python")
    first = arguments.scenes[0]
    glints = glints_of_dictionary(read_json(first)) if first.suffix == ".json" else glints_of_xml(first)
    if not glints:
        sys.exit(f"{first}: no mesh has the BSDF glint; give the shapes to plan this BSDF, with the map as its asset")
    maps = dict(entry.split("=", 1) for entry in arguments.map)
    scenes = [load(mi, path) for path in arguments.scenes]
    document = plan_scene(scenes, mi, arguments.tolerance, arguments.unit_m, maps, glints)
    arguments.output.write_text(json.dumps(document, indent=1) + "\n")


if __name__ == "__main__":
    main()
