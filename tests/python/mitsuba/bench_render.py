"""Time of a rendering with the BSDF `glint` beside Mitsuba's `roughconductor`: the same scene, samples and integrator.

    python tests/python/mitsuba/bench_render.py [--size 512] [--spp 16] [--variant llvm_ad_rgb] [--all]

Prints the best of three renderings of each, after one that compiles the kernels.
"""

import argparse
import os
import sys
import time

import drjit as dr
import mitsuba as mi

import glint_ndf as gn
import glint_ndf.mitsuba as gm

sys.path.insert(0, os.path.dirname(__file__))
from conftest import make_scene  # noqa: E402


def seconds(render, scene, spp, repeats=3):
    times = []
    for k in range(repeats + 1):
        start = time.perf_counter()
        image = render(scene, spp=spp, seed=k)
        dr.eval(image)
        dr.sync_thread()
        times.append(time.perf_counter() - start)
    return min(times[1:])


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--size", type=int, default=512)
    parser.add_argument("--spp", type=int, default=16)
    parser.add_argument("--variant", default="llvm_ad_rgb")
    parser.add_argument("--all", action="store_true", help="compressed pyramids and bin maps too: minutes")
    options = parser.parse_args()
    mi.set_variant(options.variant)
    noise = gn.synth("isotropic", 512, seed=1, alpha=0.2)
    pyramid = gn.pyramid(noise, stride=16)
    glints = {"ndf-pyramid": pyramid}
    if options.all:
        glints.update({"ndf-cp": gn.compress(pyramid, tolerance=0.1), "bin-map": gn.bin_map(noise)})
    for light in ("area", "constant"):
        for integrator in ("path", "glint_path"):
            depth = {"type": integrator, "max_depth": 3}
            plain = make_scene({"type": "roughconductor", "alpha": 0.2, "material": "Al"}, light, depth, options.size)
            base = seconds(mi.render, plain, options.spp)
            print(f"{light}, {integrator}: roughconductor {base:.2f} s", flush=True)
            for kind, asset in glints.items():
                bsdf = {"type": "glint", "asset": asset.path, "material": "Al", "uv_scale": 4.0}
                if integrator == "path":
                    bsdf["sigma"] = 4.0
                took = seconds(gm.render, make_scene(bsdf, light, depth, options.size), options.spp)
                print(f"  glint, {kind}: {took:.2f} s, {took / base:.1f} x", flush=True)


if __name__ == "__main__":
    main()
