"""A zoom as an animation, and how much it flickers.

The camera turns nothing but its zoom: every point of the surface keeps its directions of light and view, so a frame differs from the one before only by
what its pixels cover. Frame t, shrunk to the scale of frame t + 1, should be frame t + 1. The flicker is the mean absolute difference of the two over the
mean of the frames. It is not 0 for an exact answer, because shrinking a picture interpolates between pixels: so the exact answer's is given, too.
"""

import numpy as np

import ball
import pictures

FROM_CM, TO_CM = 3.6, 24.0
TEXELS_A_PIXEL = 20  # of the first frame in which flicker is measured: above the finest level of the pyramid


def widths(frames):
    return FROM_CM * (TO_CM / FROM_CM) ** (np.arange(frames) / (frames - 1))


def shrink(image, factor):
    """A picture at another scale round its centre; the pixel filter grows with it (a Gaussian of deviation half a pixel)."""
    n = image.shape[0]
    centres = (np.arange(n) + 0.5 - n / 2) * factor + n / 2
    deviation = np.sqrt(max(0.25 * (factor**2 - 1), 0.3**2))  # at least so wide that single pixels do not show
    weights = np.exp(-0.5 * ((np.arange(n) + 0.5 - centres[:, None]) / deviation) ** 2)
    weights /= np.maximum(weights.sum(axis=1, keepdims=True), 1e-12)
    return np.einsum("ij,jkc,lk->ilc", weights, image, weights, optimize=True)


def flicker(frames, factor):
    """@param frames  linear light of square frames
    @param factor  by which each frame sees more than the one before
    """
    n = frames[0].shape[0]
    edge = int(np.ceil(0.5 * n * (1 - 1 / factor))) + 2  # of frame t + 1, which frame t does not see
    inside = slice(edge, n - edge)
    differences = [np.abs(shrink(a, factor) - shrink(b, 1.0))[inside, inside].mean() for a, b in zip(frames, frames[1:])]
    return float(np.mean(differences) / np.mean([frame[inside, inside].mean() for frame in frames]))


def one_texel(of):
    """The map as a renderer takes it without filtering: one texel for each sample."""
    import mitsuba as mi

    texture = {
        "type": "bitmap",
        "filename": str(of.image),
        "raw": True,
        "filter_type": "nearest",
        "to_uv": mi.ScalarTransform4f().scale([1 / of.cm, 1 / of.cm, 1]),
    }
    facet = {"type": "roughconductor", "material": "Cu", "distribution": "beckmann", "alpha": 2**0.5 * of.sigma_r}
    return {"type": "normalmap", "normalmap": texture, "bsdf": facet}


def frames_of(gallery, label, which, count, size, spp, **how):
    width = widths(count)
    return [
        gallery.render(f"{label}, frame {k + 1} of {count}", ball.scene(gallery.kit, width[k], size, spp, **how), quiet=True)
        for k in which
    ]


def measured(gallery):
    """Flicker of the pyramid, of the exact answer and of a map without filtering, over small frames: the exact answer is slow."""
    size, spp, count = (96, 96), 4, 6
    factor = (TO_CM / FROM_CM) ** (1 / 23)
    width = size[0] * TEXELS_A_PIXEL * ball.TEXEL_UM * 1e-4 * factor ** np.arange(count)
    frames = lambda **how: [
        gallery.render("flicker", ball.scene(gallery.kit, w, size, spp, max_depth=2, **how), quiet=True).linear for w in width
    ]
    return {
        "the pyramid": flicker(frames(), factor),
        "Reference": flicker(frames(asset=lambda of: of.normals), factor),
        "one texel for each sample": flicker(frames(bsdf=one_texel), factor),
    }


def draw(gallery):
    size, spp = gallery.scaled((200, 200), 8)
    count = 12 if gallery.kit.quick else 24
    factor = widths(count)[1] / widths(count)[0]
    frames = frames_of(gallery, "animation", range(count), count, size, spp)
    steps = [flicker([a.linear, b.linear], factor) for a, b in zip(frames, frames[1:])]
    file = gallery.out / "animation.gif"
    pictures.animation([p.srgb() for p in frames + frames[-2:0:-1]], file)
    gallery.enter(
        "animation",
        file,
        {
            "title": "A zoom without flicker",
            "alt": "An animated zoom from a patch of flakes to the whole ball and back",
            "method": "pyramid",
            "text": "Frames differ by their zoom alone. Flicker is the mean difference of a frame from the one before, brought to its scale, over the mean of the "
            "frames. Six small frames flicker by "
            + ", ".join(f"{100 * value:.1f} % with {name}" for name, value in measured(gallery).items())
            + f": what Reference shows is the noise of samples and the error of bringing frames to scale. Nothing pops: from frame to frame of this zoom the difference is {100 * np.median(steps):.0f} %, "
            f"at most {100 * max(steps):.0f} %.",
        },
        spp=frames[0].spp,
        seconds=sum(p.seconds for p in frames),
    )
