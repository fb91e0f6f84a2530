"""The integrator `glint_path`: a path tracer that knows the footprint of every hit."""

import drjit as dr
import mitsuba as mi

from . import beam as beams
from .exchange import is_jit
from .options import Options
from .prefilter import Prefilter
from .wavefront import wavefront

NAME = "glint_path"

#: Samples that are traced at once: their state takes about 1 GB.
_MOST_LANES = 1 << 22

_OF_THE_BASE_CLASS = ("hide_emitters", "samples_per_pass", "block_size", "timeout")


def make_class():
    """The class of the plugin, for the current variant."""

    class GlintPath(mi.SamplingIntegrator):
        """See docs/MITSUBA.md for the parameters."""

        def __init__(self, props):
            mi.SamplingIntegrator.__init__(self, props)
            options = Options(NAME, props)
            depth = options.integer("max_depth", -1, low=-1)
            self.max_depth = 0x7FFFFFFF if depth == -1 else depth
            self.rr_depth = options.integer("rr_depth", 5, low=1)
            self.whole_pixels = options.text("footprint", "sample", ("sample", "pixel")) == "pixel"
            self.hides = options.flag("hide_emitters", False)
            self._widening = 1.0
            self.lobes = options.integer("prefilter", 0, low=0)
            self._prefilter = None
            self._rendering = False
            options.any_of(_OF_THE_BASE_CLASS)
            options.finish()

        def render(self, scene, sensor=0, seed=0, spp=0, develop=True, evaluate=True):
            if self._rendering:
                # Mitsuba's own `render` calls this one first.
                return mi.SamplingIntegrator.render(self, scene, sensor, seed, spp, develop, evaluate)
            if not isinstance(sensor, mi.Sensor):
                sensor = scene.sensors()[sensor]
            own = sensor.sampler().sample_count()
            samples = spp or own
            self._rendering = True
            try:
                with wavefront():
                    self._prefilter = Prefilter.of(scene, self.lobes)
                    passes = _passes(sensor, samples) if develop else [samples]
                    return _mean_of_passes(
                        lambda part, n: self._render_pass(scene, sensor, _seed(seed, part), n, samples, develop, evaluate),
                        passes,
                    )
            finally:
                self._rendering = False
                # Passes leave their number of samples in the sampler.
                sensor.sampler().set_sample_count(own)
                # The prefilter refers to the scene, which refers to this integrator; and the scene may change until the next picture.
                self._prefilter = None

        def _render_pass(self, scene, sensor, seed, spp, samples, develop, evaluate):
            # Mitsuba shrinks differentials to the part of the pixel that one sample of this pass stands for.
            self._widening = spp**0.5 if self.whole_pixels else (spp / samples) ** 0.5
            return mi.SamplingIntegrator.render(self, scene, sensor, seed, spp, develop, evaluate)

        def sample(self, scene, sampler, ray, medium=None, active=True):
            with wavefront():
                ray = _with_differentials(ray, self._widening)
                radiance, valid = _trace(self, self._prefilter, scene, sampler, ray, mi.Bool(active))
                return radiance, valid, []

        def aov_names(self):
            return []

        def to_string(self):
            return f"GlintPath[max_depth = {self.max_depth}, rr_depth = {self.rr_depth}]"

    return GlintPath


def _trace(options, prefilter, scene, sampler, ray, active):
    """Radiance along camera rays, and whether they hit something that is shown."""
    context = mi.BSDFContext()
    radiance, throughput, eta = mi.Spectrum(0), mi.Spectrum(1), mi.Float(1)
    beam = beams.of_pixel(ray)
    previous = dr.zeros(mi.Interaction3f)
    previous_pdf, previous_mirror = mi.Float(1), mi.Bool(True)
    # Lanes whose light of the environment has been counted by the prefilter.
    lit_by_sky = mi.Bool(False)
    # Lanes that see something: the environment counts, unless emitters are hidden.
    shown = mi.Bool(not options.hides and scene.environment() is not None)
    depth = 0
    while True:
        si = scene.ray_intersect(
            mi.Ray3f(ray), ray_flags=mi.RayFlags.All | mi.RayFlags.dNSdUV, coherent=mi.Bool(depth == 0), active=active
        )
        if depth == 0 and options.hides:
            si = _behind_emitters(scene, ray, si, active)
        found = active & ((lit_by_sky & (si.is_valid() ^ True)) ^ True)
        radiance = radiance + _emission(options, scene, si, previous, previous_pdf, previous_mirror, throughput, depth, found)
        hit = active & si.is_valid()
        if depth == 0:
            shown = shown | hit
        if depth + 1 >= options.max_depth:
            break
        active = hit
        if not dr.any(active):
            break

        beam = beams.propagated(beam, dr.select(active, si.t, 0))
        if depth == 0 and ray.has_differentials:
            si.compute_uv_partials(ray)  # exact
        else:
            beams.write_partials(beam, ray, si)

        # Light from a sample of an emitter, and the next direction.
        bsdf = si.bsdf()
        ds, light = scene.sample_emitter_direction(si, sampler.next_2d(active), True, active)
        lit = active & (ds.pdf != 0) & mi.has_flag(bsdf.flags(), mi.BSDFFlags.Smooth)
        if prefilter is not None:
            of_sky, lit_by_sky = prefilter.light(scene, si, sampler, active)
            radiance = radiance + throughput * of_sky
            lit = lit & ((lit_by_sky & prefilter.is_sky(ds.emitter)) ^ True)
        towards = si.to_local(ds.d)
        value, pdf, drawn, weight = bsdf.eval_pdf_sample(
            context, si, towards, sampler.next_1d(active), sampler.next_2d(active), active
        )
        mis = dr.select(ds.delta, 1, _power(ds.pdf, pdf))
        radiance = radiance + dr.select(lit, throughput * value * light * mis, 0)

        mirrored = mi.has_flag(drawn.sampled_type, mi.BSDFFlags.Delta)
        throughput = throughput * weight
        eta = eta * drawn.eta
        previous, previous_pdf, previous_mirror = mi.Interaction3f(si), drawn.pdf, mirrored
        beam = beams.bounced(beam, si, drawn.wo, drawn.pdf, mirrored)
        ray = mi.RayDifferential3f(si.spawn_ray(si.to_world(drawn.wo)))
        depth += 1

        active, throughput = _roulette(sampler, throughput, eta, active, depth >= options.rr_depth)
        if is_jit():
            dr.eval(radiance, throughput, eta, beam, previous, previous_pdf, previous_mirror, ray, active)
    return dr.select(shown, radiance, 0) if options.hides else radiance, shown


def _behind_emitters(scene, ray, si, active):
    """The first hit of a camera ray that does not emit; emitting shapes before it are passed."""
    while True:
        emits = (
            active & (si.shape != None) & si.shape.is_emitter() if is_jit() else si.is_valid() and si.shape.is_emitter()
        )  # noqa: E711
        if not dr.any(emits):
            return si
        flags = mi.RayFlags.All | mi.RayFlags.dNSdUV
        behind = scene.ray_intersect(si.spawn_ray(ray.d), ray_flags=flags, coherent=mi.Bool(True), active=emits)
        behind.t = behind.t + si.t
        si = dr.select(emits, behind, si)


def _roulette(sampler, throughput, eta, active, play):
    """Ends paths that carry no light, and where `play` says so paths that carry little, at random."""
    largest = dr.max(throughput)
    active = active & (largest > 0)
    if not play:
        return active, throughput
    keep = dr.minimum(largest * eta * eta, 0.95)
    return active & (sampler.next_1d(active) < keep), throughput / dr.maximum(keep, 1e-6)


def _with_differentials(ray, widening):
    """A copy of a camera ray, with its differentials times `widening`. Plain copies of rays drop differentials."""
    copy = mi.RayDifferential3f(ray)
    if getattr(ray, "has_differentials", False):
        copy.o_x, copy.o_y, copy.d_x, copy.d_y = ray.o_x, ray.o_y, ray.d_x, ray.d_y
        copy.has_differentials = True
        copy.scale_differential(widening)
    return copy


def _emission(options, scene, si, previous, pdf, mirrored, throughput, depth, active):
    """Light that the hit emits, weighted against the chance that a sample of an emitter had found it."""
    if depth == 0 and options.hides:
        return mi.Spectrum(0)
    emitter = si.emitter(scene, active)
    if not is_jit() and emitter is None:
        return mi.Spectrum(0)
    found = active & (emitter != None) if is_jit() else active  # noqa: E711
    ds = mi.DirectionSample3f(scene, si, previous)
    of_emitter = scene.pdf_emitter_direction(previous, ds, found & (mirrored ^ True))
    weight = dr.select(mirrored, 1, _power(pdf, of_emitter))
    return dr.select(found, throughput * emitter.eval(si, found) * weight, 0)


def _power(a, b):
    """The power heuristic of multiple importance sampling."""
    a2, b2 = a * a, b * b
    return dr.select(a > 0, a2 / dr.maximum(a2 + b2, 1e-37), 0)


def _passes(sensor, samples):
    """Samples of each pass, so that the state of all paths fits into memory."""
    if not is_jit():
        return [samples]
    size = sensor.film().crop_size()
    largest = max(1, _MOST_LANES // max(1, int(size[0]) * int(size[1])))
    return [min(largest, samples - first) for first in range(0, samples, largest)]


def _seed(seed, part):
    """The seed of a pass: the first has the seed of the picture. Others are hashed, so that neighbouring seeds share no pass."""
    return seed if part == 0 else mi.sample_tea_32(mi.UInt32(seed), part)[0]


def _mean_of_passes(render, passes):
    """The mean of several renderings, each weighted by its samples."""
    if len(passes) == 1:
        return render(0, passes[0])
    image = None
    for part, samples in enumerate(passes):
        share = render(part, samples) * (samples / sum(passes))
        image = share if image is None else image + share
        dr.eval(image)
    return image
