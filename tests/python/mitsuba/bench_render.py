"""Time of a rendering with the BSDF `glint` beside Mitsuba's `roughconductor`: the same scene, samples and integrator.

    python tests/python/mitsuba/bench_render.py [--size 512] [--spp 16] [--variant llvm_ad_rgb] [--all]

Prints the best of three renderings of each, after one that compiles the kernels: by the clock and, for busy machines, by the time of all
processors. With GLINT_MITSUBA_PLUGINS set (test_native.py)
the C++ form too. `path` has a fixed footprint, `glint_path` that of the pixel; roughconductor is rendered by plain mi.render.
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

PLUGINS = os.environ.get("GLINT_MITSUBA_PLUGINS", "")


def seconds(render, scene, spp, repeats=3):
    """Least seconds of a clock and of all processors together."""
    times = []
    for k in range(repeats + 1):
        start = time.perf_counter(), time.process_time()
        image = render(scene, spp=spp, seed=k)
        dr.eval(image)
        dr.sync_thread()
        times.append((time.perf_counter() - start[0], time.process_time() - start[1]))
    return tuple(min(column) for column in zip(*times[1:]))


def assets(with_all):
    noise = gn.synth("isotropic", 512, seed=1, alpha=0.2)
    pyramid = gn.pyramid(noise, stride=16)
    made = {"ndf-pyramid": pyramid}
    if with_all:
        made.update({"ndf-cp": gn.compress(pyramid, tolerance=0.1), "bin-map": gn.bin_map(noise)})
    return made


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--size", type=int, default=512)
    parser.add_argument("--spp", type=int, default=16)
    parser.add_argument("--variant", default="llvm_ad_rgb")
    parser.add_argument("--all", action="store_true", help="compressed pyramids and bin maps too: minutes")
    options = parser.parse_args()
    mi.set_variant(options.variant)
    scalar = options.variant.startswith("scalar")
    if PLUGINS:
        mi.file_resolver().append(PLUGINS)
    # Python asks one point at a time in scalar variants: minutes.
    forms = ([] if scalar and PLUGINS else ["glint"]) + (["glint_native"] if PLUGINS else [])
    made = assets(options.all)
    for light in ("area", "constant"):
        for integrator in ("path",) if scalar else ("path", "glint_path"):
            depth = {"type": integrator, "max_depth": 3}
            plain = make_scene({"type": "roughconductor", "alpha": 0.2, "material": "Al"}, light, depth, options.size)
            base = seconds(mi.render, plain, options.spp)
            print(f"{light}, {integrator}: roughconductor {base[0]:.2f} s, {base[1]:.2f} CPU s", flush=True)
            for kind, asset in made.items():
                for form in forms:
                    bsdf = {"type": form, "asset": asset.path, "material": "Al", "uv_scale": 4.0}
                    if integrator == "path":
                        bsdf["sigma"] = 8.0
                    took = seconds(gm.render, make_scene(bsdf, light, depth, options.size), options.spp)
                    print(f"  {form}, {kind}: {took[0]:.2f} s, {took[1]:.2f} CPU s: {took[1] / base[1]:.2f} x the CPU time", flush=True)


if __name__ == "__main__":
    main()
