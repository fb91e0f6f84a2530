"""Shared by the scenes: maps made by the tools, materials, lights, rendering, and the tone curve."""

import dataclasses
import hashlib
import json
import pathlib
import subprocess
import sys

import numpy as np


def start_mitsuba(variant="llvm_ad_rgb"):
    """Chooses the variant, and registers the plugins."""
    try:
        import mitsuba as mi

        mi.set_variant(variant)
        import glint_ndf.mitsuba  # noqa: F401
    except ImportError as error:
        sys.exit(f"{error}; run `make python`, and use build/venv/bin/python")


@dataclasses.dataclass
class Map:
    """A prepared map: normals, and what was made of them."""

    kit: "Kit"
    name: str
    size: int  # texels along each axis
    texel_cm: float
    sigma_r: float  # intrinsic roughness of a facet
    normals: pathlib.Path
    image: pathlib.Path  # what the normals were read from

    @property
    def cm(self):
        """Length of a side."""
        return self.size * self.texel_cm

    def alpha(self):
        """Beckmann roughness of a smooth surface whose NDF is as high straight up as that of the whole map."""
        whole = self.kit.run("query", self.pyramid(), "--uv", 0, 0, "--sigma", 4 * self.size, "--half", 0, 0)
        return float(np.clip(1 / np.sqrt(np.pi * whole["density"]), 0.02, 0.6))

    def made(self, tool, suffix, *flags, source=None):
        """The asset that a tool makes of the normals, or of another asset."""
        return self.kit.make(f"{self.name}.{suffix}", tool, source or self.normals, *flags)

    def pyramid(self, stride=16):
        return self.made("pyramid", "pyramid", "--stride", stride, "--sigma-r", self.sigma_r, "--resolution", "auto")


class Kit:
    """Programs and folders of one run.

    @param bin      folder of the programs
    @param folder   folder of assets and meshes
    @param quick    small pictures of few samples
    @param smooth   smooth metal instead of glints, for comparison
    """

    def __init__(self, bin, folder, quick=False, smooth=False):
        self.bin, self.folder, self.quick, self.smooth = pathlib.Path(bin), pathlib.Path(folder), quick, smooth
        self.folder.mkdir(parents=True, exist_ok=True)

    def run(self, tool, *arguments):
        """Runs a tool; a failure ends this program with the tool's own message."""
        command = [str(self.bin / f"glint-{tool}"), *map(str, arguments), "--json", "--quiet"]
        try:
            done = subprocess.run(command, stdout=subprocess.PIPE)
        except FileNotFoundError:
            sys.exit(f"{command[0]} is missing: run `make build` first")
        if done.returncode:
            sys.exit(f"failed with exit code {done.returncode}: {' '.join(command)}")
        return json.loads(done.stdout)["result"] if done.stdout else {}

    def make(self, name, tool, source, *flags, suffix=".glint"):
        """Runs a tool once for the same name, source and flags: the file is kept between runs."""
        key = hashlib.sha256(json.dumps([tool, str(source), *map(str, flags)]).encode()).hexdigest()[:10]
        path = self.folder / f"{name}.{key}{suffix}"
        if not path.exists():
            self.run(tool, *([source] if source else []), "-o", path, *flags)
        return path

    def map(self, kind, size=2048, texel_um=5.0, sigma_r=0.02, seed=7, **flags):
        """Normals by glint-synth; flags are its options, with _ for -."""
        size = size // 2 if self.quick else size  # smaller ones show that they repeat
        options = [word for key, value in flags.items() for word in (f"--{key.replace('_', '-')}", value)]
        image = self.make(kind, "synth", None, kind, "--size", size, "--seed", seed, *options, suffix=".exr")
        name = image.stem
        return Map(self, name, size, texel_um * 1e-4, sigma_r, self.make(name, "ingest", image), image)

    def metal(self, of, asset, material="Al", **parameters):
        """A BSDF of a prepared map on a mesh whose uv are centimetres. With `smooth`, Mitsuba's own metal of the same mean roughness."""
        if self.smooth:
            return {
                "type": "twosided",
                "bsdf": {"type": "roughconductor", "material": material, "distribution": "beckmann", "alpha": of.alpha()},
            }
        import glint_ndf

        # Some kinds have no roughness of their own; pyramids take the normals for footprints below level 0.
        kind = glint_ndf.load(asset).kind
        exact = {"sigma_r": of.sigma_r} if kind in ("normals", "slope-moments") else {}
        exact |= {"normals": str(of.normals)} if kind in ("ndf-pyramid", "ndf-cp") else {}
        return {"type": "glint", "asset": str(asset), **exact, "uv_scale": 1 / of.cm, "material": material, **parameters}

    def integrator(self, max_depth=2, **parameters):
        """Footprints are those of whole pixels: a few samples show a glint without noise."""
        if self.smooth:
            return {"type": "path", "max_depth": max_depth}
        return {"type": "glint_path", "max_depth": max_depth, "footprint": "pixel", **parameters}

    def mesh(self, name, mesh):
        """The dictionary of a shape, without its BSDF."""
        return {"type": "ply", "filename": str(mesh.write(self.folder / f"{name}.ply"))}


def look_at(origin, target, fov, size, spp, up=(0, 0, 1), crop=None):
    """A perspective camera.

    @param size  (width, height), pixels
    @param fov   degrees across the width
    """
    import mitsuba as mi

    film = {
        "type": "hdrfilm",
        "width": size[0],
        "height": size[1],
        "pixel_format": "rgb",
        "component_format": "float32",
        "rfilter": {"type": "gaussian", "stddev": 0.4},
    }
    if crop:
        film |= dict(zip(("crop_offset_x", "crop_offset_y", "crop_width", "crop_height"), crop))
    return {
        "type": "perspective",
        "fov": fov,
        "near_clip": 0.1,
        "far_clip": 10000,
        "to_world": mi.ScalarTransform4f().look_at(origin=list(origin), target=list(target), up=list(up)),
        "film": film,
        "sampler": {"type": "independent", "sample_count": spp},
    }


def rgb(*value):
    return {"type": "rgb", "value": list(value if len(value) > 1 else value * 3)}


def point_light(position, intensity, colour=(1, 1, 1)):
    return {"type": "point", "position": list(position), "intensity": rgb(*(intensity * c for c in colour))}


def softbox(centre, target, size, radiance, colour=(1, 1, 1)):
    """A rectangle of light that faces a target."""
    import mitsuba as mi

    t = mi.ScalarTransform4f
    up = (0, 0, 1) if abs(np.asarray(target) - centre)[:2].sum() > 1e-6 else (0, 1, 0)
    return {
        "type": "rectangle",
        "to_world": t().look_at(origin=list(centre), target=list(target), up=list(up))
        @ t().scale([size[0] / 2, size[1] / 2, 1]),
        "emitter": {"type": "area", "radiance": rgb(*(radiance * c for c in colour))},
        "bsdf": {"type": "diffuse", "reflectance": rgb(0)},
    }


def studio(boxes, floor=0.06, ceiling=0.25, width=1024):
    """An image of a room's light over all directions, for `envmap`. Azimuth 0 is x, 90 is y.

    @param boxes  rows of (azimuth in degrees, elevation in degrees, half width, half height in degrees, radiance, colour)
    """
    height = width // 2
    azimuth = 90 - (np.arange(width) + 0.5) / width * 360  # Mitsuba's images run from -z to x, which `envmap` turns to y and x
    elevation = 90 - (np.arange(height) + 0.5) / height * 180
    up = np.clip(elevation / 90, -1, 1)[:, None, None]
    image = np.ones((1, width, 3)) * np.where(
        up > 0, floor + (ceiling - floor) * np.maximum(up, 0) ** 0.8, floor * (1 + 0.6 * up)
    )
    for at, above, half_width, half_height, radiance, colour in boxes:
        across = np.abs((azimuth - at + 180) % 360 - 180)
        edge = lambda distance, half: np.clip(0.5 + (half - distance) / 3, 0, 1)  # soft over 3 degrees
        shape = edge(across, half_width)[None, :] * edge(np.abs(elevation - above), half_height)[:, None]
        image = image + shape[..., None] * radiance * np.asarray(colour)
    return image.astype(np.float32)


def envmap(image, scale=1.0, turn=0.0):
    """An emitter of an image of `studio`, with z up, turned round z by degrees."""
    import mitsuba as mi

    t = mi.ScalarTransform4f
    return {
        "type": "envmap",
        "bitmap": mi.Bitmap(np.ascontiguousarray(image)),
        "scale": scale,
        "to_world": t().rotate([0, 0, 1], turn) @ t().rotate([1, 0, 0], 90),
    }


def tone(linear, exposure=1.0):
    """Linear Rec. 709 light as an sRGB picture, by Khronos' PBR Neutral tone curve: colours of materials stay, highlights roll off."""
    c = np.maximum(np.nan_to_num(np.asarray(linear, float)), 0) * exposure
    start, desaturation = 0.8 - 0.04, 0.15
    least = c.min(axis=-1, keepdims=True)
    c = c - np.where(least < 0.08, least - 6.25 * least**2, 0.04)
    peak = np.maximum(c.max(axis=-1, keepdims=True), 1e-9)
    room = 1 - start
    rolled = np.where(peak > start, 1 - room**2 / np.maximum(peak + room - start, room), peak)
    grey = np.where(peak > start, 1 - 1 / (desaturation * (peak - rolled) + 1), 0)
    c = np.clip((c * rolled / peak) * (1 - grey) + rolled * grey, 0, 1)
    return np.where(c <= 0.0031308, 12.92 * c, 1.055 * c ** (1 / 2.4) - 0.055)


def to_bytes(image):
    return np.round(255 * np.clip(image, 0, 1)).astype(np.uint8)
