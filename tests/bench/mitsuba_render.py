"""Times whole renderings of a glinting plane beside Mitsuba's own roughconductor: the cost of an asset in a renderer.

    build/venv/bin/python tests/bench/mitsuba_render.py [--spp 64] [--size 512]

`evaluate`: a point light, so each sample asks for one value. `sample`: a constant environment and one sample of the BSDF, as Deng 2022
(Table 3) has them. Same scene, integrator and number of samples; medians of runs that take turns. Footprints come from the differentials of
rays in scalar_rgb, where Mitsuba's `direct` computes them; in llvm_ad_rgb they are given. `round`: stretched footprints count as one round one, as
in the paper.
"""

import argparse
import pathlib
import statistics
import tempfile
import time

import glint_ndf as gn
import glint_ndf.mitsuba as glint_mitsuba
import glint_ndf.mitsuba.native as native

ROUNDS = 5
SIGMA = 32.0  # texels
LIGHTS = {
    "evaluate": {"type": "point", "position": [0.5, -1.0, 2.0], "intensity": {"type": "rgb", "value": 10.0}},
    "sample": {"type": "constant", "radiance": 0.5},
}
# Integrators that ask a BSDF once a sample.
INTEGRATORS = {
    "evaluate": {"type": "direct", "emitter_samples": 1, "bsdf_samples": 0},
    "sample": {"type": "direct", "emitter_samples": 0, "bsdf_samples": 1},
}


def scene_of(mi, question, bsdf, size, spp):
    return mi.load_dict(
        {
            "type": "scene",
            "integrator": INTEGRATORS[question],
            "sensor": {
                "type": "perspective",
                "fov": 30,
                "to_world": mi.ScalarTransform4f().look_at([0, -3, 2], [0, 0, 0], [0, 0, 1]),
                "film": {"type": "hdrfilm", "width": size, "height": size},
                "sampler": {"type": "independent", "sample_count": spp},
            },
            "light": LIGHTS[question],
            "plane": {"type": "rectangle", "bsdf": bsdf},
        }
    )


def timed(mi, scene):
    import drjit as dr

    start = time.perf_counter()
    image = glint_mitsuba.render(scene, seed=1)
    dr.eval(image)
    dr.sync_thread()
    return time.perf_counter() - start


def compare(variant, question, bsdfs, size, spp):
    """Median seconds of each BSDF, and the median of their ratios to the first."""
    import mitsuba as mi

    mi.set_variant(variant)
    native.load()
    scenes = {name: scene_of(mi, question, bsdf, size, spp) for name, bsdf in bsdfs.items()}
    times = {name: [] for name in scenes}
    for turn in range(ROUNDS + 1):
        for name, scene in scenes.items():
            seconds = timed(mi, scene)
            if turn > 0:  # the first compiles
                times[name].append(seconds)
    first = times[next(iter(times))]
    return {name: (statistics.median(t), statistics.median(a / b for a, b in zip(t, first))) for name, t in times.items()}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--size", type=int, default=512, help="pixels along each axis")
    parser.add_argument("--spp", type=int, default=16, help="samples a pixel")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        flakes = gn.synth("flakes", 1024)
        path = pathlib.Path(folder) / "p.glint"
        gn.pyramid(flakes).save(path)
        facets = {"asset": str(path), "material": "Al", "uv_scale": 16.0}
        bsdfs = {
            "roughconductor": {"type": "roughconductor", "material": "Al", "distribution": "beckmann", "alpha": 0.3},
            "glint_native": {"type": "glint_native", **facets},
            "glint_native, round": {"type": "glint_native", "footprint_parts": 1, **facets},
            "glint": {"type": "glint", **facets},
        }
        print("variant       question   BSDF                seconds  ratio")
        for variant in ("scalar_rgb", "llvm_ad_rgb"):
            for question in LIGHTS:
                if variant == "scalar_rgb":
                    wanted = {n: b for n, b in bsdfs.items() if n != "glint"}  # which asks one point at a time
                else:
                    wanted = {n: b if n == "roughconductor" else {**b, "sigma": SIGMA} for n, b in bsdfs.items()}
                    del wanted["glint_native, round"]
                for name, (seconds, ratio) in compare(variant, question, wanted, options.size, options.spp).items():
                    print(f"{variant:<13} {question:<10} {name:<19} {seconds:7.3f}  {ratio:5.2f}")


if __name__ == "__main__":
    main()
