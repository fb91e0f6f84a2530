"""A sheet of isotropic noise in a room: light found by samples, and by lobes that stand for the room (Deng 2022, section 5.4, figure 11)."""

import bent_quad
from kit import envmap, studio
from models import flip

ROOM = studio(
    [(100, 55, 14, 10, 12, (1, 0.95, 0.85)), (60, 40, 10, 10, 5, (0.8, 0.9, 1)), (-60, 50, 30, 20, 1.5, (1, 1, 1))],
    floor=0.05,
    ceiling=0.2,
)
EXPOSURE = 0.3
SPP = 8
TRUTH_SPP = 128
LOBES = 12


def scene(kit, size=(300, 218), spp=64, lobes=0):
    """@param lobes  spherical Gaussians that stand for the room; 0: samples"""
    description = bent_quad.scene(kit, "isotropic", size, spp) | {
        "integrator": kit.integrator(2, prefilter=lobes),
        "room": envmap(ROOM),
    }
    del description["light"]
    return description


def draw(gallery):
    kit = gallery.kit
    size, spp = gallery.scaled((300, 218), SPP)
    draw_one = lambda title, *how, **more: gallery.render(f"environment, {title}", scene(kit, size, *how), EXPOSURE, **more)
    truth = draw_one("truth", TRUTH_SPP, seed=1000)
    samples, lobes = draw_one("samples", spp), draw_one("lobes", spp, LOBES)
    same_time = draw_one("samples for as long", round(spp * lobes.seconds / samples.seconds))
    sheet = {
        f"{spp} samples a pixel": samples,
        f"{spp} lobes a pixel": lobes,
        f"{same_time.spp} samples a pixel": same_time,
        f"truth: {truth.spp} samples": truth,
    }
    notes = {
        title: f"{picture.seconds:.1f} s" + (f", FLIP {flip(truth.srgb(), picture.srgb()):.3f}" if picture is not truth else "")
        for title, picture in sheet.items()
    }
    gallery.sheet(
        "environment",
        sheet,
        columns=4,
        notes=notes,
        title="The light of a room",
        method="pyramid, as titled",
        alt="A sheet of fine noise in a room, four times: grainy, less grainy, nearly smooth, smooth",
        text=f"The room becomes {LOBES} spherical Gaussians. Each sample picks one, and takes the mean density over its half vectors (`prefilter`). "
        "Which lobe is picked is noise too, and a mean takes longer than a density: plain samples come nearer to the truth in less time.",
    )
