"""Times whole commands and queries on 2K^2 maps, and measures errors; prints one table and writes results.json.

Normally run by `make bench`. Every figure is the median of several runs, in a file cache that the first run warmed.
"""

import argparse
import json
import os
import pathlib
import subprocess
import sys

sys.path[:0] = [str(pathlib.Path(__file__).parents[2] / folder) for folder in ("pipelines", "pipelines/demo")]
from machine import machine  # noqa: E402
from processes import Tools  # noqa: E402

# Inputs: name -> arguments of glint-synth.
MAPS = {
    "isotropic": ["isotropic", "--alpha", 0.2, "--seed", 1],
    "brushed": ["brushed", "--seed", 2],
    "flakes": ["flakes", "--flake-size", 6, "--alpha", 0.2, "--seed", 3],
}
MB = 1e6
# Nanoseconds of the authors' inverse bin map for the 21 weights of a query: (map, alpha) -> footprints of 4^2, 16^2, 64^2,
# 256^2, 1024^2.
BIN_MAP_AUTHORS = {
    ("isotropic 1K", 0.0025): (2448, 2668, 3197, 7113),
    ("isotropic 1K", 0.01): (3099, 3782, 8178, 27034),
    ("isotropic 1K", 0.04): (4056, 8401, 27716, 105466),
    ("isotropic 1K", 0.16): (4545, 12073, 40903, 154321),
    ("Gaussian 2K", 0.0025): (2582, 2598, 2644, 3052, 4639),
    ("Gaussian 2K", 0.01): (3544, 3420, 4047, 7661, 25625),
    ("Gaussian 2K", 0.04): (4820, 5457, 9827, 30889, 98485),
    ("Gaussian 2K", 0.16): (6043, 10739, 33897, 120403, 457324),
    ("brushed 2K", 0.01): (4701, 5397, 9027, 27758, 83114),
}
# Share of a slanted box that HistogramNdf may misplace by default (kSlantTolerance).
SLANT_TOLERANCE = 0.06
# Roughness of the lobes whose light is in the table; the chart has others.
LIGHT_SIGMA = 0.05
# Area lights, so that no image is needed: a window and two lamps.
STUDIO = {
    "lights": [
        {"type": "rectangle", "centre": [2, -1, 1.5], "axis_u": [-0.3, -0.7, 0], "axis_v": [0, 0, 0.6], "radiance": [6, 7, 8]},
        {"type": "sphere", "centre": [-1, 2, 3], "radius": 0.3, "radiance": [60, 50, 40]},
        {"type": "sphere", "centre": [-3, -2, 2], "radius": 0.1, "radiance": [900, 900, 900]},
    ]
}
# Relative errors that coefficients of these types reach on every map.
LEAST_ERROR = {"i8": 0.01, "f16": 0.002, "f32": 0}


class Table:
    """The figures: what, measured, unit, and what to hold it against."""

    def __init__(self):
        self.rows = []
        self.section = ""

    def add(self, figure, value, unit, target=None, paper="", design="", cannot_hold="", **details):
        """@param target       the value must not be more
        @param cannot_hold  why the target cannot hold for this kind of asset: then the value is not held against it"""
        self.rows.append(
            {
                "section": self.section,
                "figure": figure,
                "value": value,
                "unit": unit,
                "target": target,
                "cannot_hold": cannot_hold,
                "paper": paper,
                "design": design,
                "details": details,
            }
        )
        print_row(self.rows[-1])


def over_target(row):
    return row["target"] is not None and not row.get("cannot_hold") and row["value"] > row["target"]


def batch_cannot_gain(asked, kind):
    """Why a batch of this kind of asset cannot answer three times as many queries as one by one; nothing where it can."""
    if kind != "pyramid":
        return "A query of this kind has enough work or cache misses of its own to overlap: a batch gains nothing but the call."
    if asked.endswith("few"):
        return "The same few queries stay in the caches: a batch has no misses to overlap."
    return "A mean is long work next to its cache misses." if asked.startswith("mean") else ""


def print_row(row):
    target = "" if row["target"] is None else f"<= {row['target']:g} {row['unit']}"
    verdict = "" if row["target"] is None else "OVER" if over_target(row) else "-" if row["cannot_hold"] else "ok"
    value = f"{row['value']:.4g} {row['unit']}"
    print(f"{row['figure']:<46} {value:>13} {target:>13} {verdict:<5} {row['paper']:<19} {row['design']}", flush=True)


def print_header():
    print(f"{'figure':<46} {'measured':>13} {'target':>13} {'':<5} {'paper':<19} design's floor")


SECTIONS = [
    "synth_and_ingest",
    "pyramids",
    "compressions",
    "moments",
    "queries",
    "query_command",
    "below_level_0",
    "displacements",
    "histograms",
    "light",
    "bin_maps",
    "accuracy",
]


class Bench:
    def __init__(self, arguments):
        self.tools = Tools(arguments.bin)
        self.folder = arguments.out
        self.repeats = arguments.repeats
        self.size = arguments.size
        self.samples = arguments.samples
        self.table = Table()
        self.folder.mkdir(parents=True, exist_ok=True)

    def path(self, name, kind=""):
        return self.folder / (f"{name}.{kind}.glint" if kind else f"{name}.glint")

    def process(self, figure, tool, *arguments, **against):
        """Times a tool and adds its wall time; returns the run."""
        run = self.tools.repeat(self.repeats, tool, *arguments)
        self.table.add(figure, run.wall_s, "s", cpu_s=run.cpu_s, peak_mb=run.peak_mb, **against)
        return run

    def make_maps(self):
        """PNGs of 8 bits, as maps come from artists. Made once: they depend on nothing but these arguments."""
        for name, flags in MAPS.items():
            image = self.folder / f"{name}.png"
            stamp = self.folder / f"{name}.args"
            arguments = " ".join(map(str, [*flags, "--size", self.size]))
            if not image.exists() or not stamp.exists() or stamp.read_text() != arguments:
                self.tools.run("synth", *flags, "--size", self.size, "-o", image)
                stamp.write_text(arguments)

    def synth_and_ingest(self):
        self.process("synth flakes", "synth", *MAPS["flakes"], "--size", self.size, "-o", self.folder / "timed.exr")
        self.process("synth isotropic", "synth", *MAPS["isotropic"], "--size", self.size, "-o", self.folder / "timed.exr")
        (self.folder / "timed.exr").unlink()
        self.process("ingest an 8-bit PNG", "ingest", self.folder / "flakes.png", "-o", self.path("flakes"), target=0.6)
        for name in ("isotropic", "brushed"):
            self.tools.run("ingest", self.folder / f"{name}.png", "-o", self.path(name))

    def pyramids(self):
        peak = 0
        levels = ["--levels", self.size.bit_length() - 6]  # strides from 32 to half the map; 6 levels of 2K^2
        for name, paper in (("isotropic", ""), ("brushed", "37 min, 40 cores"), ("flakes", "43 min, 40 cores")):
            run = self.process(
                f"pyramid, flat, {name}",
                "pyramid",
                self.path(name),
                "-o",
                self.path(name, "pyramid"),
                *levels,
                target=2,
                paper=paper,
                design="0.9 s, 1 thread",
            )
            peak = max(peak, run.peak_mb)
        # Weave is the steepest map, so that its smooth pyramid needs the most memory.
        self.tools.run("synth", "weave", "--seed", 4, "--size", self.size, "-o", self.folder / "weave.png")
        self.tools.run("ingest", self.folder / "weave.png", "-o", self.path("weave"))
        for name in (*MAPS, "weave"):
            run = self.process(
                f"pyramid, smooth, {name}",
                "pyramid",
                self.path(name),
                "-o",
                self.path(name, "smooth"),
                *levels,
                "--surface",
                "smooth",
                target=10 if name in MAPS else None,
            )
            peak = max(peak, run.peak_mb)
        self.table.add("peak memory of the pyramids", peak / 1024, "GiB", target=2)

    def displacements(self):
        """Targets are for 1K^2 (and 4K^2, diffuse) on two cores, whatever the size of the other maps."""
        size = self.size // 2
        runs = [(size, "diffuse:0.8", 5), (size, "ggx:0.3", 12), (size, "ggx:0.1", 30), (4 * size, "diffuse:0.8", 60)]
        for side, base, target in runs:
            name = f"height{side}"
            if not self.path(name).exists():
                image = self.folder / f"{name}.exr"
                self.tools.run("synth", "isotropic", "--alpha", 0.5, "--height", "--size", side, "-o", image)
                self.tools.run("ingest", image, "--kind", "height", "--to", "heights", "-o", self.path(name))
            run = self.process(
                f"displace, factor 16, {base}, {side}^2",
                "displace",
                self.path(name),
                "-o",
                self.path(name, "displaced"),
                "--factor",
                16,
                "--base",
                base,
                "--quiet",
                target=target,
                paper="22 to 24 min, 6 cores" if "diffuse" in base else "22 to 36 min, 6 cores",
            )
            if (side, base) == (size, "diffuse:0.8"):
                self.displace_colors(name, side)
            if side == size:
                self.table.add(f"peak memory, displace {base}, {side}^2", run.peak_mb / 1024, "GiB", target=1)
        self.table.add(
            "bytes of T and S",
            run.result["levels"][0]["scale_bytes"] / 1000,
            "KB",
            target=250,
            paper="202 to 589 KB, of S alone",
        )

    def displace_colors(self, name, side):
        """A base of three channels, and the light that it reflects; no target names them."""
        image = self.folder / f"colour{side}.png"
        if not image.exists():
            self.tools.run(
                "synth", "isotropic", "--alpha", 0.5, "--size", side, "-o", image
            )  # any colours will do: those of normals
        run = self.process(
            f"displace, factor 16, RGB diffuse, {side}^2",
            "displace",
            self.path(name),
            "-o",
            self.path(name, "rgb"),
            "--factor",
            16,
            "--base-color",
            image,
            "--quiet",
        )
        self.table.add(
            "bytes of T and S, RGB",
            run.result["levels"][0]["scale_bytes"] / 1000,
            "KB",
            target=250,
            paper="202 to 589 KB, of S alone",
        )
        for kind in ("displaced", "rgb"):
            asked = self.tools.run(
                "query",
                "reflectance",
                self.path(name, kind),
                "--uv",
                0.3,
                0.7,
                "--level",
                0,
                "--wi",
                0.5,
                0,
                1,
                "--wo",
                -0.2,
                0.1,
                1,
                "--repeat",
                100000,
            )
            self.table.add(f"light reflected by a displacement, {kind}, warm", asked.result["nanoseconds"], "ns")

    def compress(self, figure, name, kind, *flags, **against):
        run = self.process(figure, "compress", self.path(name, "pyramid"), "-o", self.path(name, kind), *flags, **against)
        return run.result["total"]["rel_l2"], run.result["total_bytes"]

    def compressions(self):
        cp16 = {}
        for name, limit, paper in (("brushed", 8, "10 min, 40 cores"), ("isotropic", None, "")):
            cp16[name] = self.compress(
                f"compress, cp 16, {name}", name, "cp16", "--method", "cp", "--rank", 16, target=limit, paper=paper
            )
        cp16["flakes"] = self.compress(
            "compress, cp 32, flakes", "flakes", "cp32", "--method", "cp", "--rank", 32, target=40, paper="60 min, 40 cores"
        )
        for name, (error, size) in cp16.items():
            kind = "cp 32" if name == "flakes" else "cp 16"
            self.table.add(f"relative error, {kind}, {name}", error, "")
            self.table.add(
                f"bytes, {kind}, {name}", size / MB, "MB", paper={"flakes": "107 MiB", "brushed": "15 MiB"}.get(name, "")
            )
            coefficients = next(word for word, least in LEAST_ERROR.items() if error >= least)
            for method in ("tucker", "pca"):
                reached, bytes_used = self.compress(
                    f"compress, {method} to the error of {kind}, {name}",
                    name,
                    f"{method}-tolerance",
                    "--method",
                    method,
                    "--metric",
                    "l2",
                    "--tolerance",
                    error,
                    "--quantize",
                    coefficients,
                    target=4,
                )
                self.table.add(
                    f"bytes over those of {kind}, {method}, {name}",
                    bytes_used / size,
                    "",
                    target=1 / 3,
                    rel_l2=reached,
                    bytes=bytes_used,
                )

        for name in MAPS:
            run = self.process(
                f"compress, tucker to a seen error of 10 %, {name}",
                "compress",
                self.path(name, "pyramid"),
                "-o",
                self.path(name, "tucker-seen"),
                "--tolerance",
                0.1,
            )
            self.table.add(f"bytes at a seen error of 10 %, {name}", run.result["total_bytes"] / MB, "MB")
        self.noise_tensors()

    def noise_tensors(self):
        """Errors of all 16x16x64 tensors of the finest level of Gaussian noise, for which the design has figures of another such map."""
        image, normals, pyramid = self.folder / "noise.exr", self.path("noise"), self.path("noise", "pyramid")
        self.tools.run("synth", "isotropic", "--size", self.size, "-o", image)
        self.tools.run("ingest", image, "-o", normals)
        self.tools.run("pyramid", normals, "-o", pyramid, "--levels", 1)
        for method, rank, design in (("cp", 16, 0.171), ("cp", 32, 0.123), ("tucker", 25, 0.167)):
            run = self.tools.run(
                "compress",
                pyramid,
                "-o",
                self.path("noise", "compressed"),
                "--method",
                method,
                "--rank",
                rank,
                "--regions",
                self.size // 256,
                "--quantize",
                "f32",
            )
            self.table.add(
                f"relative error, {method} {rank}, 16x16x64 of noise",
                run.result["total"]["rel_l2"],
                "",
                target=design,
                design=f"{design}",
            )

    def assets(self, name):
        cp = "cp32" if name == "flakes" else "cp16"
        return [self.path(name, kind) for kind in ("pyramid", cp, "tucker-tolerance", "pca-tolerance")]

    def queries(self):
        """Google Benchmark in one process for each map; nanoseconds, and milliseconds to open."""
        for name in MAPS:
            output = self.folder / f"{name}.queries.json"
            command = [
                self.tools.folder / "glint-query-bench",
                self.path(name),
                *self.assets(name),
                self.path(name, "moments"),
                f"--benchmark_out={output}",
                "--benchmark_out_format=json",
                f"--benchmark_repetitions={self.repeats}",
                "--benchmark_min_time=0.2",
                "--benchmark_report_aggregates_only=true",
            ]
            # It says much on stderr that is no error; its exit code tells.
            call(command, stderr=subprocess.DEVNULL)
            for entry in json.loads(output.read_text())["benchmarks"]:
                # Google Benchmark has no median of a single run.
                if entry.get("aggregate_name", "median") != "median":
                    continue
                what, file = entry["run_name"].split("/")[:2]  # then its settings
                if what.startswith("ratio_batch_"):
                    asked = what.removeprefix("ratio_batch_").replace("_", ", ")
                    kind = file.removeprefix(name + ".").removesuffix(".glint")
                    self.table.add(
                        f"{asked}, in a batch over alone, {name} {kind}",
                        1 / entry["ratio"],
                        "x",
                        target=0.333,
                        cannot_hold=batch_cannot_gain(asked, kind),
                    )
                    continue
                if what.startswith("ratio_"):
                    # To a plain microfacet model in the same run.
                    asked = what.removeprefix("ratio_").replace("_", ", ")
                    self.table.add(
                        f"{asked} over plain GGX, {name} {file.removeprefix(name + '.').removesuffix('.glint')}",
                        entry["ratio"],
                        "x",
                        target=6 if not asked.startswith("density") else 1.3 if "moments" in file else 4,
                    )
                    continue
                kind = f"{name} {file.removeprefix(name + '.').removesuffix('.glint')}"
                if what == "open":
                    # The target is for 100 MB; smaller files have to keep it too.
                    self.table.add(
                        f"open {kind.removesuffix(' glint')}, {entry['file_bytes'] / MB:.0f} MB",
                        entry["real_time"],
                        "ms",
                        target=5,
                    )
                else:
                    self.table.add(
                        f"{what.replace('_', ', ')}, {kind}",
                        entry["cpu_time"],
                        "ns",
                        target=150 if what == "density_warm" and file != "ggx" else None,
                    )

    def moments(self):
        """One lobe for each footprint."""
        for name in MAPS:
            run = self.process(f"moments, {name}", "moments", self.path(name), "-o", self.path(name, "moments"), target=0.5)
            self.table.add(f"bytes of moments, {name}", run.result["size_bytes"] / MB, "MB")

    def histograms(self):
        """Memory and time of accumulated histograms against the distance of the table's points."""
        for name in MAPS:
            strides = {4: 200, 8: None, 16: 40, 32: None}
            for stride, megabytes in strides.items():
                run = self.process(
                    f"histograms, stride {stride}, {name}",
                    "sat",
                    self.path(name),
                    "-o",
                    self.path(name, f"sat{stride}"),
                    "--bins",
                    "9x32",
                    "--stride",
                    stride,
                    target=1.5,
                    paper="at most 9 s for all tables, 32 cores",
                )
                self.table.add(
                    f"bytes of histograms, stride {stride}, {name}",
                    run.result["size_bytes"] / MB,
                    "MB",
                    target=megabytes,
                    paper="1.1 GB in the text, 2304 MiB by its table",
                    bins=run.result["bins"],
                )
            text = call([self.tools.folder / "glint-sat-bench", *(self.path(name, f"sat{stride}") for stride in strides)])
            for asset in json.loads(text):
                for query in asset["queries"]:
                    size, stride = query["size_texels"], asset["stride_texels"]
                    kind = f"{size}^2{' rotated' if query['rotated'] else ''}"
                    target = (3 if size <= 256 else 10) if stride == 4 else None
                    self.table.add(
                        f"histogram of {kind}, stride {stride}, {name}",
                        query["histogram_ns"] / 1000,
                        "us",
                        target=target,
                        stride=stride,
                        **query,
                    )
                    if query["rotated"] and stride == 4:
                        self.table.add(f"histogram of {kind}, exactly, {name}", query["exact_ns"] / 1000, "us")
                        self.table.add(
                            f"mean variation of {kind} from exact, {name}",
                            query["variation"]["mean"],
                            "",
                            target=SLANT_TOLERANCE,
                            largest=query["variation"]["largest"],
                        )

    def light(self):
        """Tables of spherical harmonics by their tools; errors and times of the product integral by sh_light.cpp."""
        lights = self.folder / "studio.json"
        lights.write_text(json.dumps(STUDIO))
        paper = "7 min for lobes and light together, 32 cores"
        self.process(
            "SH lobes, order 60, 65x128",
            "shlobes",
            "--sigma-r",
            0.05,
            "--order",
            60,
            "--grid",
            "65x128",
            "-o",
            self.folder / "lobes.glint",
            target=2,
            paper=paper,
        )
        for grid, target in (("17x32", None), ("33x64", None), ("65x128", 15)):
            self.process(
                f"SH light, order 60, {grid}",
                "shlobes",
                "--light",
                lights,
                "--order",
                60,
                "--grid",
                grid,
                "-o",
                self.folder / "light.glint",
                target=target,
                paper=paper if target else "",
            )
        text = call([self.tools.folder / "glint-sh-bench"])
        (self.folder / "light.json").write_text(text)
        results = json.loads(text)
        for row in results["errors_by_order"]:
            if round(row["sigma_r"], 4) == LIGHT_SIGMA and row["order"] in (10, 30, 60, 100):
                self.table.add(f"light, error, {row['light']}, order {row['order']}", row["none"], "", **row)
        for row in results["times_at_equal_error"]:
            name = f"{row['light']}, order {row['order']}"
            ours = row["nearest"]
            self.table.add(f"light, product integral, {name}", ours["us"], "us", error=ours["error"])
            self.table.add(
                f"light, Monte Carlo at equal error, {name}", ours["monte_carlo_us"], "us", samples=ours["monte_carlo_samples"]
            )

    def query_command(self):
        asset = self.path("flakes", "cp32")
        run = self.tools.repeat(
            self.repeats, "query", asset, "--uv", 0.3, 0.7, "--sigma", 40, "--half", 0.1, -0.05, "--repeat", 300000
        )
        self.table.add("density, warm, by glint-query --repeat", run.result["nanoseconds"], "ns", target=150)

    def below_level_0(self):
        """Footprints of a few texels from the texels, beside Reference in one process; see near_bench.cpp."""
        text = call([self.tools.folder / "glint-near-bench", *(self.path(name) for name in MAPS)])
        (self.folder / "near.json").write_text(text)
        for run in json.loads(text):
            kind = f"{run['map'].removesuffix('.glint')}, {run['surface']}, {run['shape']}, sigma {run['sigma_texels']:g}"
            for what in ("random", "own", "sample", "mean"):
                asked = run[what]
                name = f"{what if what in ('sample', 'mean') else f'density, {what}'}, {kind}"
                self.table.add(f"from texels, {name}", asked["us"], "us", reference_us=asked["reference_us"])
                self.table.add(f"from texels over Reference, {name}", asked["us"] / asked["reference_us"], "x")
                # The stated error, of many questions together; a mean has few.
                self.table.add(f"from texels, error, {name}", asked["error"], "", target=1e-3)

    def accuracy(self):
        for name in MAPS:
            text = call([self.tools.folder / "glint-accuracy", self.path(name), *self.assets(name), "--samples", self.samples])
            (self.folder / f"{name}.accuracy.json").write_text(text)
            for asset in json.loads(text):
                kind = pathlib.Path(asset["asset"]).name.removeprefix(name + ".").removesuffix(".glint")
                worst = lambda place, figure: max(abs(level[place][figure]) for level in asset["levels"] if place in level)
                pyramid = kind == "pyramid"
                for figure, limit in (("rel_l2", 0.01), ("tv", None), ("energy", 1e-3)):
                    self.table.add(
                        f"{figure} at centres, worst octave, {name} {kind}",
                        worst("centres", figure),
                        "",
                        target=limit if pyramid else None,
                        levels=asset["levels"],
                    )
                self.table.add(f"rel_l2 at random, worst octave, {name} {kind}", worst("random", "rel_l2"), "")

    def bin_maps(self):
        """Every cell of the authors' table beside ours, build times, bytes and errors. One process; see binmap_bench.cpp."""
        text = call([self.tools.folder / "glint-binmap-bench"])
        (self.folder / "binmap.json").write_text(text)
        for run in json.loads(text):
            name, alpha = run["map"], round(run["alpha"], 4)
            two_k = run["size"] == 2048
            self.table.add(
                f"bin map, build, {name}, {alpha}",
                run["build_ms"],
                "ms",
                target=80 if two_k else None,
                paper=".2 to .3 s; the authors' code here 180 to 310 ms" if two_k else "",
                cpu_ms=run["build_cpu_ms"],
            )
            self.table.add(
                f"bin map, bytes, {name}, {alpha}",
                run["bytes"] / 2**20,
                "MiB",
                target=24 if two_k else None,
                paper="36 to 43 MB; the authors' code here 35 to 42 MiB" if two_k else "",
            )
            for k, entry in enumerate(run["queries"]):
                authors = BIN_MAP_AUTHORS.get((name, alpha), ())
                figure = f"bin map, weights, {name}, {alpha}, {entry['side']:.0f}^2"
                if k < len(authors):
                    ratio = authors[k] / entry["weights_ns"]
                    self.table.add(
                        figure,
                        entry["weights_ns"],
                        "ns",
                        target=authors[k] / 5,
                        paper=f"the authors' code here {authors[k]} ns, {ratio:.1f} x",
                        **entry,
                    )
                else:
                    self.table.add(figure, entry["weights_ns"], "ns", **entry)
                # The authors' density takes their weights, and a lobe for each.
                cell = f"{name}, {alpha}, {entry['side']:.0f}^2"
                self.table.add(
                    f"bin map, density, {cell}", entry["density_ns"], "ns", target=authors[k] if k < len(authors) else None
                )
                self.table.add(f"bin map, published density, {cell}", entry["published_ns"], "ns")
            limit = 0.05 if "8-bit" in name else 0.015
            for entry in run["errors"]:
                self.table.add(
                    f"bin map, median error, {name}, {alpha}, {entry['side']:.0f}^2", entry["median"], "", target=limit
                )
                self.table.add(
                    f"bin map, median error as published, {name}, {alpha}, {entry['side']:.0f}^2", entry["published_median"], ""
                )
                self.table.add(
                    f"bin map, energy, {name}, {alpha}, {entry['side']:.0f}^2", abs(entry["energy"]), "", target=0.005
                )

        text = call([self.tools.folder / "glint-binmap-bench", "--range"])
        (self.folder / "binmap-range.json").write_text(text)
        for run in json.loads(text):
            name = run["map"]
            self.table.add(f"bin map for a range, bytes over those of five, {name}", run["range_bytes"] / run["own_bytes"], "")
            self.table.add(
                f"bin map for a range, building over that of five, {name}", run["range_build_ms"] / run["own_build_ms"], ""
            )
            for entry in run["densities"]:
                figure = f"{name}, {entry['alpha']:.2f}, {entry['side']:.0f}^2"
                self.table.add(f"bin map for a range, density, {figure}", entry["range_ns"], "ns", own_ns=entry["own_ns"])
                if "range_error" in entry:
                    self.table.add(
                        f"bin map for a range, median error, {figure}", entry["range_error"]["median"], "", target=0.015
                    )

    def write(self):
        """Figures of an earlier run at this size stay where this one has not measured them."""
        path = self.folder / "results.json"
        earlier = json.loads(path.read_text()) if path.exists() else {"size_texels": self.size, "rows": []}
        measured = {row["figure"] for row in self.table.rows}
        kept = [row for row in earlier["rows"] if row["figure"] not in measured] if earlier["size_texels"] == self.size else []
        results = {"machine": machine(), "size_texels": self.size, "repeats": self.repeats, "rows": kept + self.table.rows}
        path.write_text(json.dumps(results, indent=1) + "\n")

    def summarize(self):
        over = sum(map(over_target, self.table.rows))
        print(f"\n{len(self.table.rows)} figures measured, {over} over their target; all in {self.folder}/results.json")


def call(command, stderr=None):
    process = subprocess.run([str(word) for word in command], stdout=subprocess.PIPE, stderr=stderr, text=True)
    if process.returncode != 0:
        sys.exit(f"failed with exit code {process.returncode}: {' '.join(map(str, command))}")
    return process.stdout


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--bin", type=pathlib.Path, default="build/bin", help="folder of the programs")
    parser.add_argument("--out", type=pathlib.Path, default="build/bench", help="folder for maps, assets and results")
    parser.add_argument("--size", type=int, default=2048, help="texels of the maps along each axis; targets are for 2048")
    parser.add_argument("--repeats", type=int, default=3)
    parser.add_argument("--samples", type=int, default=8, help="footprints of each octave for errors")
    parser.add_argument(
        "--only",
        nargs="+",
        choices=SECTIONS,
        default=SECTIONS,
        metavar="SECTION",
        help=f"run some sections, with the assets that an earlier run left: {', '.join(SECTIONS)}",
    )
    arguments = parser.parse_args()
    bench = Bench(arguments)
    if os.getloadavg()[0] > 0.5 * os.cpu_count():
        print(f"warning: the machine is busy (load {os.getloadavg()[0]:.1f}); times will be too long", file=sys.stderr)
    bench.make_maps()
    print_header()
    for section in arguments.only:
        bench.table.section = section
        getattr(bench, section)()
        bench.write()  # what was measured stays when a later section is stopped
    bench.summarize()


if __name__ == "__main__":
    main()
