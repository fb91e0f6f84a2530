"""One scene by every method: time and error against Reference, with equal samples and with equal time."""

import numpy as np

import bent_quad
import pictures

MAP = "flakes"
SIZE = (160, 120)
TRUTH_SPP = 16
FOV = 5.0  # degrees: a pixel sees 17 texels
SPP = 8

# title -> how the map is prepared
METHODS = {
    "pyramid": lambda of: of.pyramid(),
    "cp, rank 32": lambda of: of.made("compress", "cp", "--method", "cp", "--rank", 32, source=of.pyramid()),
    "tucker, 10 %": lambda of: of.made("compress", "tucker", "--method", "tucker", "--tolerance", 0.1, source=of.pyramid()),
    "bin map": lambda of: of.made("binmap", "bins", "--alpha", 2**0.5 * of.sigma_r),
    "histograms": lambda of: of.made("sat", "sat"),
    "moments": lambda of: of.made("moments", "moments"),
}


def flip(truth, image):
    """Mean FLIP error of sRGB pictures, 0..1."""
    import flip_evaluator

    return float(
        flip_evaluator.evaluate(truth.astype(np.float32), image.astype(np.float32), "LDR", inputsRGB=True, applyMagma=False)[1]
    )


def draw(gallery):
    kit = gallery.kit
    size, spp = gallery.scaled(SIZE, SPP)
    of = kit.map(**bent_quad.MAPS[MAP][0], texel_um=bent_quad.TEXEL_UM)
    scene = lambda asset, samples: bent_quad.scene(kit, MAP, size, samples, asset=asset, fov=FOV)
    exact = lambda of: of.normals
    truth = gallery.render("models, truth", scene(exact, max(SPP, TRUTH_SPP if not kit.quick else SPP)))
    reference = gallery.render("models, Reference", scene(exact, spp), seed=1000)
    equal = {"Reference": reference} | {
        title: gallery.render(f"models, {title}", scene(asset, spp), seed=1000) for title, asset in METHODS.items()
    }
    slowest = reference.seconds
    table = [
        "| method | file | processor time, equal samples | FLIP | samples in the time of Reference | FLIP |",
        "|---|---|---|---|---|---|",
    ]
    notes, sheet = {}, {}
    for title, picture in equal.items():
        path = exact(of) if title == "Reference" else METHODS[title](of)
        samples = max(1, round(spp * slowest / picture.seconds))
        same_time = (
            picture
            if title == "Reference"
            else gallery.render(f"models, {title}, equal time", scene(METHODS[title], samples), seed=2000)
        )
        errors = [flip(truth.srgb(), p.srgb()) for p in (picture, same_time)]
        notes[title] = f"{picture.seconds:.1f} s, FLIP {errors[0]:.3f}\n{same_time.spp} samples: {errors[1]:.3f}"
        sheet[title] = picture
        table.append(
            f"| {title} | {path.stat().st_size / 1e6:.1f} MB | {picture.seconds:.1f} s | {errors[0]:.3f} | {same_time.spp} | {errors[1]:.3f} |"
        )
    sheet = {f"truth, {truth.spp} samples": truth} | sheet
    gallery.sheet(
        "models",
        sheet,
        columns=4,
        notes=notes,
        title="Every method",
        method="as titled, times of each in the table",
        table=table,
        alt="The bent sheet of flakes by Reference, pyramid, cp, tucker, bin map, histograms and moments",
        text=f"Every method answers the same scene; notes say the processor time of {spp} samples a pixel and the FLIP error against Reference with {truth.spp}, then how many "
        "samples fit into the time of Reference, and the error with these. Part of an error is the noise of sampling: Reference with other random "
        "numbers has it, too. Histograms know directions to ten degrees, and moments one lobe: neither is made for small lights.",
    )
