"""A material of Blender from the textures of glint-moments, and a picture of it.

    glint-moments brushed.glint -o brushed.moments.glint --roughness 0.1 --lobe materialx --bits 16 --textures textures
    python3 pipelines/blender/moments_material.py textures --level 4 -o brushed.png

runs with Blender as a module (package bpy), or inside Blender: `blender -b -P moments_material.py -- textures -o brushed.png`. Other
scripts import `moments_material`. The textures hold one lobe for each texel, so that glints become a smooth highlight.
"""

import argparse
import math
import pathlib
import sys

import bpy

# Principled BSDF: alpha along and across are roughness^2 / aspect and roughness^2 aspect, with aspect^2 = 1 - 0.9 anisotropic. In
# MaterialX's textures aspect^2 = 1 - anisotropy.
ANISOTROPIC_PER_ANISOTROPY = 1 / 0.9
ALUMINIUM = (0.912, 0.914, 0.920, 1)


def texture_of(nodes, folder, name, level, mapping, interpolation="Linear"):
    """An image node of one texture, with its numbers as they are."""
    path = pathlib.Path(folder) / f"{name}_{level:02}.png"
    if not path.is_file():
        raise FileNotFoundError(f"{path}: no such texture; write it with glint-moments --lobe materialx --textures {folder}")
    node = nodes.new("ShaderNodeTexImage")
    node.image = bpy.data.images.load(str(path.resolve()))
    node.image.colorspace_settings.name = "Non-Color"
    node.interpolation = interpolation
    nodes.id_data.links.new(mapping.outputs["Vector"], node.inputs["Vector"])
    return node


def moments_material(name, folder, level=0, uv_map="UVMap", repeats=1, base_color=ALUMINIUM, metallic=1):
    """A Principled BSDF of the lobes of one level.

    folder: textures of `glint-moments --lobe materialx`. level: Cycles has no levels of detail, so take the one whose texels are about
    as large as the pixels of the picture. repeats: of the map in one unit of the UV map.
    """
    material = bpy.data.materials.new(name)
    material.use_nodes = True
    nodes, link = material.node_tree.nodes, material.node_tree.links.new
    surface = nodes["Principled BSDF"]
    surface.distribution = "GGX"  # single bounces between facets, as all models of glint
    surface.inputs["Base Color"].default_value = base_color
    surface.inputs["Metallic"].default_value = metallic

    place = nodes.new("ShaderNodeUVMap")
    place.uv_map = uv_map
    mapping = nodes.new("ShaderNodeMapping")
    mapping.inputs["Scale"].default_value = (repeats, repeats, 1)
    link(place.outputs["UV"], mapping.inputs["Vector"])

    # The mean normal. Green is up, as in Blender.
    bump = nodes.new("ShaderNodeNormalMap")
    bump.uv_map = uv_map
    link(texture_of(nodes, folder, "normal", level, mapping).outputs["Color"], bump.inputs["Color"])
    link(bump.outputs["Normal"], surface.inputs["Normal"])

    link(texture_of(nodes, folder, "roughness", level, mapping).outputs["Color"], surface.inputs["Roughness"])

    # Principled takes at most 1, where the smaller alpha is a tenth of the larger.
    scale = nodes.new("ShaderNodeMath")
    scale.operation = "MULTIPLY"
    scale.use_clamp = True
    scale.inputs[1].default_value = ANISOTROPIC_PER_ANISOTROPY
    link(texture_of(nodes, folder, "anisotropy", level, mapping).outputs["Color"], scale.inputs[0])
    link(scale.outputs["Value"], surface.inputs["Anisotropic"])

    # Turns from the tangent, counter-clockwise, to the larger alpha. Angles of neighbours must not be mixed: 0.49 and 0 are close.
    tangent = nodes.new("ShaderNodeTangent")
    tangent.direction_type = "UV_MAP"
    tangent.uv_map = uv_map
    link(tangent.outputs["Tangent"], surface.inputs["Tangent"])
    link(
        texture_of(nodes, folder, "rotation", level, mapping, "Closest").outputs["Color"],
        surface.inputs["Anisotropic Rotation"],
    )
    return material


def square_scene(material, height, lamp_radius, power, resolution, samples, uv_angle_rad=0):
    """A square of 2 x 2 seen from straight above, lit by a lamp at the camera: half vectors grow outwards from the middle."""
    mesh = bpy.data.meshes.new("square")
    mesh.from_pydata([(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)], [], [(0, 1, 2, 3)])
    c, s = math.cos(uv_angle_rad), math.sin(uv_angle_rad)
    uv = mesh.uv_layers.new(name="UVMap")
    for corner, (x, y) in enumerate([(-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5)]):
        uv.data[corner].uv = (c * x + s * y + 0.5, c * y - s * x + 0.5)
    mesh.materials.append(material)

    lamp = bpy.data.lights.new("lamp", "POINT")
    lamp.energy = power * height**2  # so that the height does not change the light on the square
    lamp.shadow_soft_size = lamp_radius
    camera = bpy.data.cameras.new("camera")
    camera.angle = 2 * math.atan(1 / height)
    scene = bpy.context.scene
    for data in (mesh, lamp, camera):
        thing = bpy.data.objects.new(data.name, data)
        scene.collection.objects.link(thing)
        thing.location.z = 0 if data is mesh else height
        if data is camera:
            scene.camera = thing

    scene.world = None
    scene.render.engine = "CYCLES"
    scene.cycles.samples = samples
    scene.cycles.use_denoising = False
    scene.cycles.max_bounces = 1
    scene.render.resolution_x = scene.render.resolution_y = resolution
    scene.view_settings.view_transform = "Standard"


def render(path):
    """Writes a .png, or an .exr with linear values."""
    scene = bpy.context.scene
    scene.render.image_settings.file_format = "OPEN_EXR" if str(path).endswith(".exr") else "PNG"
    scene.render.image_settings.color_depth = "32" if str(path).endswith(".exr") else "8"
    scene.render.filepath = str(pathlib.Path(path).resolve())
    bpy.ops.render.render(write_still=True)


def main(arguments):
    parser = argparse.ArgumentParser(description="Draws a square of the textures of glint-moments, lit from the camera.")
    parser.add_argument("textures", help="folder of glint-moments --lobe materialx --textures")
    parser.add_argument("-o", "--output", required=True, help="picture, .png or .exr")
    parser.add_argument("--level", type=int, default=0, help="level of the textures")
    parser.add_argument("--repeats", type=float, default=1, help="of the map along a side of the square")
    parser.add_argument("--turn-deg", type=float, default=0, help="angle of the texture on the square, counter-clockwise")
    parser.add_argument("--height", type=float, default=4, help="of the camera and the lamp, in half sides of the square")
    parser.add_argument("--lamp-radius", type=float, default=0.05, help="radius of the lamp")
    parser.add_argument("--power", type=float, default=1.5, help="of the lamp, watts at a height of 1")
    parser.add_argument("--resolution", type=int, default=512, help="pixels of a side")
    parser.add_argument("--samples", type=int, default=64, help="of a pixel")
    options = parser.parse_args(arguments)
    if not options.output.endswith((".png", ".exr")):
        parser.error(f"--output: {options.output} is neither .png nor .exr")
    bpy.ops.wm.read_factory_settings(use_empty=True)
    try:
        material = moments_material("moments", options.textures, options.level, repeats=options.repeats)
    except FileNotFoundError as error:
        sys.exit(f"moments_material.py: error: {error}")
    square_scene(
        material,
        options.height,
        options.lamp_radius,
        options.power,
        options.resolution,
        options.samples,
        math.radians(options.turn_deg),
    )
    render(options.output)


if __name__ == "__main__":
    main(sys.argv[sys.argv.index("--") + 1 :] if "--" in sys.argv else sys.argv[1:])
