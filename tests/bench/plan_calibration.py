"""glint-plan on random scenes: how often a plan holds, and how far it is from the cheapest candidate of a sweep.

    python3 tests/bench/plan_calibration.py --bin build/bin --out build/plan_calibration [--scenes 30] [--size 512] [--docs docs]

A run that was stopped goes on where it was. `--docs` writes DOCS/plan-calibration.csv and its chart; `make bench-report` writes the text.
"""

import argparse
import csv
import json
import pathlib
import random
import statistics
import subprocess
import sys

# kind, name, seed of glint-synth
MAPS = [("flakes", "flakes", 3), ("isotropic", "noise", 4), ("brushed", "brushed", 5)]
POINT = {"type": "point"}
# Goals of the planner: the share of plans that hold, the median and the largest factor over the cheapest candidate that holds.
GOALS = {"held": 0.95, "median": 1.2, "worst": 1.5}
DIFFERS = 7  # exit code of glint-plan where a plan does not hold
COLUMNS = (
    "seed",
    "size",
    "map",
    "smallest_texels",
    "largest_texels",
    "sigma_r",
    "light_deg",
    "tolerance",
    "method",
    "asset",
    "holds",
    "predicted_seen",
    "actual_seen",
    "predicted_bias",
    "actual_bias",
    "over_cheapest",
    "cheapest",
)


def random_scene(seed):
    """A scene of one of MAPS."""
    chance = random.Random(seed)
    smallest = 2 ** chance.uniform(1, 4)
    light = {"type": "environment", "band_limit_deg": chance.choice([5, 20, 60])} if chance.random() < 0.7 else POINT
    material = {
        "map": chance.choice(["flakes.png", "noise.png", "brushed.png"]),
        "footprints": {"smallest_texels": smallest, "largest_texels": smallest * 2 ** chance.uniform(0, 2)},
        "tolerance": chance.choice([0.1, 0.2, 0.4]),
        "sigma_r": chance.choice([0.01, 0.03, 0.1]),
    }
    return {"schema": "glint-plan scene 1", "lights": [light], "materials": [material]}


def make_maps(programs, folder, size):
    folder.mkdir(parents=True, exist_ok=True)
    for kind, name, seed in MAPS:
        image = folder / f"{name}.png"
        if not image.exists():
            subprocess.run(
                [programs / "glint-synth", kind, "--size", str(size), "--seed", str(seed), "-o", image, "--quiet"], check=True
            )


def measured(programs, folder, seed, size):
    """A row of COLUMNS: plans a random scene, builds and checks it, and sweeps the candidates that could be cheaper."""
    scene = random_scene(seed)
    (folder / "scene.json").write_text(json.dumps(scene))
    plan = [programs / "glint-plan", "scene.json", "-o", "plan.json", "--cache", "probes", "--force", "--quiet"]
    subprocess.run(plan, cwd=folder, check=True)
    check = [programs / "glint-plan", "--check", "plan.json", "--sweep", "--json", "--quiet"]
    checked = subprocess.run(check, cwd=folder, stdout=subprocess.PIPE, text=True)
    if checked.returncode not in (0, DIFFERS):
        raise SystemExit(f"scene {seed}: glint-plan --check ended with {checked.returncode}")
    found = json.loads(checked.stdout)["result"]["materials"][0]
    planned = json.loads((folder / "plan.json").read_text())["materials"][0]
    (material,), (light,) = scene["materials"], scene["lights"]
    good = [o for o in found["sweep"] if o["seen"] <= material["tolerance"] and o["bias"] <= material["tolerance"] / 3]
    return {
        "seed": seed,
        "size": size,
        "map": material["map"].removesuffix(".png"),
        **material["footprints"],
        "sigma_r": material["sigma_r"],
        "light_deg": light.get("band_limit_deg", 0),
        "tolerance": material["tolerance"],
        "method": planned["asset"]["method"],
        "asset": found["asset"],
        "holds": int(found["holds"]),
        **{f"{when}_{what}": found[when][what] for what in ("seen", "bias") for when in ("predicted", "actual")},
        "over_cheapest": found["over_cheapest"],
        "cheapest": min(good, key=lambda o: o["bytes"])["name"] if good else "",
    }


def summary(rows):
    """The figures that GOALS names, and how many plans hold."""
    factors = [
        float(row["over_cheapest"]) for row in rows if float(row["over_cheapest"]) > 0
    ]  # 0: nothing that is as cheap holds
    count = sum(int(row["holds"]) for row in rows)
    known = factors or [float("nan")]
    return {"count": count, "held": count / len(rows), "median": statistics.median(known), "worst": max(known)}


def read_rows(path):
    with open(path, newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


def write_rows(rows, path):
    with open(path, "w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, COLUMNS, lineterminator="\n")
        writer.writeheader()
        writer.writerows(
            {key: f"{value:.6g}" if isinstance(value, float) else value for key, value in row.items()} for row in rows
        )


def chart(rows, path):
    """Errors over tolerances, predicted and actual; and costs over the cheapest."""
    from charts import COLOURS, plt

    figure, (errors, costs) = plt.subplots(1, 2, figsize=(9, 3.8))
    for method in dict.fromkeys(row["method"] for row in rows):
        of_method = [row for row in rows if row["method"] == method]
        over = lambda what: [float(row[what]) / float(row["tolerance"]) for row in of_method]
        errors.plot(over("predicted_seen"), over("actual_seen"), "o", color=COLOURS[method], label=method)
    errors.plot([0, 1.1], [0, 1.1], ":", color="0.6")
    errors.axhline(1, color="0.3", linewidth=0.8)
    errors.set(xlabel="predicted seen error over the tolerance", ylabel="actual seen error over the tolerance")
    errors.legend(fontsize=8, frameon=False, loc="upper left")
    factors = sorted(float(row["over_cheapest"]) for row in rows if float(row["over_cheapest"]) > 0)
    costs.step(range(1, len(factors) + 1), factors, where="mid", color="C0")
    for name in ("median", "worst"):
        costs.axhline(GOALS[name], color="0.3", linewidth=0.8, linestyle=":" if name == "median" else "-")
    costs.set(xlabel="scenes, sorted", ylabel="bytes over those of the cheapest")
    figure.tight_layout()
    figure.savefig(path, dpi=110, metadata={"Software": None})
    plt.close(figure)


def calibration_section(docs):
    """How plans of random scenes do; nothing where none were measured."""
    if not (docs / "plan-calibration.csv").exists():
        return ""
    rows = read_rows(docs / "plan-calibration.csv")
    figures = summary(rows)
    chart(rows, docs / "plan-calibration.png")
    return f"""
## Do plans hold?

`glint-plan` on {len(rows)} random scenes of maps of {rows[0]["size"]}^2 texels: flakes, noise and brushed metal; footprints of 2 to 64 texels; point lights and environments; tolerances of .1 to .4. Each plan
was built and measured on the whole map at other places, and so was every candidate that could be cheaper. **{figures["count"]} of {len(rows)} plans hold** (the goal is 19 of
20). They take {figures["median"]:.3g} times the bytes of the cheapest candidate that holds in the median, and {figures["worst"]:.3g} times in the worst case (the goals are {GOALS["median"]} and {GOALS["worst"]}).
[plan-calibration.csv](plan-calibration.csv) has every scene; `tests/bench/plan_calibration.py` measures it.

![Actual against predicted errors over tolerances, and the bytes of plans over those of the cheapest candidates](plan-calibration.png)

Points above the level line are plans whose error is larger than asked; others do not hold because of their bias.
"""


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--bin", type=pathlib.Path, default="build/bin", help="folder of the programs")
    parser.add_argument("--out", type=pathlib.Path, default="build/plan_calibration", help="folder to make")
    parser.add_argument("--scenes", type=int, default=30, help="number of scenes, 1 or more")
    parser.add_argument(
        "--size",
        type=int,
        default=1024,
        help="texels of a map along each axis; plans measure maps of 512 and less whole, and predict nothing",
    )
    parser.add_argument("--docs", type=pathlib.Path, help="also write DOCS/plan-calibration.csv and its chart")
    arguments = parser.parse_args()
    programs = arguments.bin.resolve()
    make_maps(programs, arguments.out, arguments.size)
    record = arguments.out / "rows.json"
    rows = json.loads(record.read_text()) if record.exists() else []
    if any(row["size"] != arguments.size for row in rows):
        raise SystemExit(f"{record} is of maps of {rows[0]['size']} texels: remove it, or give another --out")
    for seed in range(len(rows), arguments.scenes):
        rows.append(measured(programs, arguments.out, seed, arguments.size))
        record.write_text(json.dumps(rows, indent=1) + "\n")
        row = rows[-1]
        print(
            f"{seed}: {row['map']}, {row['asset']}: {'holds' if row['holds'] else 'DOES NOT HOLD'}, seen {row['predicted_seen']:.3g} predicted, {row['actual_seen']:.3g} "
            f"actual, of {row['tolerance']}; {row['over_cheapest']:.3g} times the cheapest ({row['cheapest']})",
            flush=True,
        )
    figures = summary(rows)
    print(
        f"{figures['count']} of {len(rows)} plans hold; {figures['median']:.3g} (median) and {figures['worst']:.3g} (worst) times the cheapest",
        file=sys.stderr,
    )
    if arguments.docs:
        write_rows(rows, arguments.docs / "plan-calibration.csv")
        chart(rows, arguments.docs / "plan-calibration.png")


if __name__ == "__main__":
    main()
