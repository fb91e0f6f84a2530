"""Distributions of normals, and the BRDFs that follow from them."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import numpy as np

from . import _glint
from ._arrays import Batch, FootprintArrays, members
from .assets import Asset, PathLike, temporary_file
from .errors import ArgumentError

_SURFACES = {"flat": 0, "smooth": 1}
_BOUNDARIES = {"wrap": 0, "clamp": 1}
_INTERPOLATIONS = {"footprint": 0, "trilinear": 1}
_PIXELS = {"smooth": 0, "constant": 1}
_FRESNELS = {"mirror": 0, "dielectric": 1, "conductor": 2}
_FACETS = {"distribution": 0, "beckmann": 1}
_ESTIMATORS = {"exact": 0, "published": 1}
_BINS = {"even": 0, "lobes": 1}
_KEPT_NORMALS = {"used": 0, "ignored": 1}
_SLANT_EXACT = -1.0

#: Kinds of planes without end: the whole parts of uv count.
ENDLESS_KINDS = ("tiny-example", "wang-cp", "wang-pyramid", "wang-tiles")


def _word(name: str, value: str, words: dict[str, int]) -> int:
    if value not in words:
        raise ArgumentError(f'{name}: "{value}" is not known; give one of: {", ".join(words)}')
    return words[value]


class Ndf:
    """A distribution of microscopic normals over a texture. Made by `glint_ndf.open`.

    Queries take arrays whose leading dimensions broadcast; float32 arrays are not copied. `uv` [..., 2] counts in maps, v points
    up; float64 keeps digits far out in a tiled texture. Every query takes its footprint in one of three forms:

    - `sigma` [...]: isotropic Gaussian, deviation in texels;
    - `covariance` [..., 3]: Gaussian, xx, xy and yy in texels^2 (see `glint_ndf.footprint`);
    - `box` [..., 2, 2]: parallelogram, two half axes in texels.

    Numbers that are not finite have the answers that ``glint.h`` defines. Objects are immutable: any number of threads may ask
    one. The interpreter's lock is released. `threads`: 0 takes all cores.
    """

    def __init__(self, handle: _glint.Ndf, asset: Asset | None, path: str):
        self._handle = handle
        self._asset = asset  # keeps a temporary file alive
        self.path = path  #: file that was opened
        for name, value in handle.info().items():
            setattr(self, name, value)

    kind: str  #: "normals", "ndf-pyramid", "ndf-cp", "bin-map", "histogram-sat", "slope-moments", "tiny-example", "wang-cp", "wang-pyramid", "wang-tiles", "wave-cp" or "wave-pyramid"
    width: int  #: of the normal map, texels
    height: int  #: of the normal map, texels
    resolution: int  #: pixels of an NDF image along each axis; 256 where there are none
    level_count: int  #: footprint sizes that are stored; 0: every size is answered from the texels
    sigma_r: float  #: intrinsic roughness, disk units
    surface: str  #: "flat" or "smooth"
    boundary: str  #: "wrap" or "clamp"
    has_normals: bool  #: whether footprints below level 0 are answered from the texels
    finest_sigma: float  #: footprint of level 0, deviation in texels; 0 without levels
    coarsest_sigma: float  #: footprint of the last level, deviation in texels; 0 without levels
    smallest_sigma: float  #: smallest footprint that is answered as wide as it is asked for, deviation in texels
    file_bytes: int  #: size of the asset, or of all tiles
    udim_tiles: int  #: tiles of a UDIM set; 0: no set

    @property
    def endless(self) -> bool:
        """Whether the whole parts of uv count: on planes without end, and in UDIM sets."""
        return self.kind in ENDLESS_KINDS or self.udim_tiles > 0

    @property
    def channels(self) -> int:
        """Channels of kinds wave-pyramid and wave-cp: 3 for CIE X, Y and Z, else one for each wavelength. 1 for other kinds."""
        return self._handle.channels()

    def slopes(self) -> tuple[tuple[float, float], tuple[float, float, float]]:
        """Mean (x, y) and covariance (xx, xy, yy) of the slopes of the whole map, from which masking follows."""
        return self._handle.slopes()

    def density(self, uv, h, *, sigma=None, covariance=None, box=None, spread=None, threads: int = 0) -> np.ndarray:
        """Density of normals towards half vectors, per unit projected area.

        Args:
            h: [..., 2] half vectors on the unit disk.
            spread: [..., 2] on a curved surface, half widths of the box of half vectors that each pixel sees
                (`footprint.half_vector_spread`). Answers are averaged over it, so that narrow highlights do not alias.

        Returns:
            [...] float32, >= 0.
        """
        p, half = FootprintArrays(uv, sigma, covariance, box, spread), members(h, 2, "h")
        batch = Batch(half, *p.arrays())
        out = batch.answers()
        self._handle.density(p.of(batch), batch.rows(half), out, threads)
        return batch.shaped(out)

    def density_rgb(self, uv, psi, *, sigma=None, covariance=None, box=None, threads: int = 0) -> np.ndarray:
        """Density in linear sRGB towards psi = ((wi + wo) / 2)_xy, of kinds wave-pyramid and wave-cp; others: the density in each channel.

        Returns:
            [..., 3] float32. Colours of few wavelengths may be below 0.
        """
        p, towards = FootprintArrays(uv, sigma, covariance, box), members(psi, 2, "psi")
        batch = Batch(towards, *p.arrays())
        out = batch.answers(3)
        self._handle.density_rgb(p.of(batch), batch.rows(towards), out, threads)
        return batch.shaped(out)

    def density_spectrum(self, uv, psi, *, sigma=None, covariance=None, box=None, threads: int = 0) -> np.ndarray:
        """Density of each channel towards psi: [..., channels] float32. With one channel the last dimension has one element."""
        p, towards = FootprintArrays(uv, sigma, covariance, box), members(psi, 2, "psi")
        batch = Batch(towards, *p.arrays())
        out = batch.answers(self.channels)
        self._handle.density_spectrum(p.of(batch), batch.rows(towards), out, threads)
        return out.reshape(batch.shape + (self.channels,))

    def mean(self, uv, ranges, *, sigma=None, covariance=None, box=None, spread=None, threads: int = 0) -> np.ndarray:
        """Mean density over boxes of half vectors, as a light asks for it.

        Args:
            ranges: [..., 4] x0, y0, x1 and y1.
        """
        p, boxes = FootprintArrays(uv, sigma, covariance, box, spread), members(ranges, 4, "ranges")
        batch = Batch(boxes, *p.arrays())
        out = batch.answers()
        self._handle.mean(p.of(batch), batch.rows(boxes), out, threads)
        return batch.shaped(out)

    def sample(
        self, uv, xi, *, sigma=None, covariance=None, box=None, spread=None, threads: int = 0
    ) -> tuple[np.ndarray, np.ndarray]:
        """Draws half vectors in proportion to the density.

        Args:
            xi: [..., 2] random numbers in [0, 1).

        Returns:
            h: [..., 2] half vectors. They may lie outside the disk, where facets near the horizon blur to.
            pdf: [...] per unit projected area; 0 if nothing can be drawn.
        """
        p, random = FootprintArrays(uv, sigma, covariance, box, spread), members(xi, 2, "xi")
        batch = Batch(random, *p.arrays())
        x, y, pdf = batch.answers(), batch.answers(), batch.answers()
        self._handle.sample(p.of(batch), batch.rows(random), x, y, pdf, threads)
        return batch.shaped(np.concatenate([x, y], axis=1)), batch.shaped(pdf)

    def brdf(self, fresnel: str = "mirror", eta=None, k=None, facets: str = "distribution") -> "Brdf":
        """The microfacet BRDF of this distribution, masked by the slopes of the whole map.

        Args:
            fresnel: "mirror": everything is reflected; "dielectric": reflection only, `eta` a number; "conductor": `eta` and `k`,
                each a number or three for red, green and blue.
            facets: "distribution", or "beckmann" (kind bin-map: texels are facets of Beckmann microfacets).
        """
        model = _word("fresnel", fresnel, _FRESNELS)
        wants = {"mirror": (), "dielectric": ("eta",), "conductor": ("eta", "k")}[fresnel]
        for name, value in (("eta", eta), ("k", k)):
            if (value is not None) != (name in wants):
                raise ArgumentError(
                    f"{name}: {'missing' if value is None else 'given'}, with fresnel=\"{fresnel}\", which takes "
                    f"{' and '.join(wants) or 'neither eta nor k'}"
                )
        handle = _glint.make_brdf(self._handle, model, _three("eta", eta), _three("k", k), _word("facets", facets, _FACETS))
        return Brdf(handle, self)

    def __repr__(self) -> str:
        return f"<glint_ndf.Ndf of kind {self.kind}, {self.width} x {self.height} texels>"


def _three(name: str, value) -> list[float]:
    numbers = np.asarray(0 if value is None else value, dtype=np.float32)
    if numbers.shape not in ((), (1,), (3,)):
        raise ArgumentError(f"{name}: give one number, or three for red, green and blue; the shape is {numbers.shape}")
    return np.broadcast_to(numbers, (3,)).tolist()


class Brdf:
    """A microfacet BRDF over a texture. Made by `Ndf.brdf`.

    Directions are unit vectors [..., 3] of the tangent frame (dp/du, dp/dv, n), away from the surface: radiance comes along `wi`
    and leaves along `wo`. Footprints as for `Ndf`.
    """

    def __init__(self, handle: _glint.Brdf, ndf: Ndf):
        self._handle = handle
        self.ndf = ndf  #: the distribution

    def _footprints(self, uv, sigma, covariance, box, spread=None) -> FootprintArrays:
        # On a plane without end the whole parts of uv count, and batches of doubles drop them.
        return FootprintArrays(uv, sigma, covariance, box, spread, keep_whole_parts=self.ndf.endless)

    def evaluate(
        self, uv, wi, wo, *, sigma=None, covariance=None, box=None, spread=None, threads: int = 0
    ) -> tuple[np.ndarray, np.ndarray]:
        """The BRDF and the density of its samples.

        Returns:
            f: [..., 3] red, green and blue, 1/sr, without the cosine of wi.
            pdf: [...] density with which `sample` draws wi, per unit solid angle.
        """
        p = self._footprints(uv, sigma, covariance, box, spread)
        inward, outward = members(wi, 3, "wi"), members(wo, 3, "wo")
        batch = Batch(inward, outward, *p.arrays())
        f, pdf = batch.answers(3), batch.answers()
        self._handle.evaluate(p.of(batch), batch.rows(inward), batch.rows(outward), f, pdf, threads)
        return batch.shaped(f), batch.shaped(pdf)

    def sample(
        self, uv, wo, xi, *, sigma=None, covariance=None, box=None, spread=None, threads: int = 0
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Draws wi for views wo.

        Returns:
            wi: [..., 3]; 0 where nothing was drawn.
            weight: [..., 3] f wi.z / pdf.
            pdf: [...] per unit solid angle; 0 where nothing was drawn.
        """
        p = self._footprints(uv, sigma, covariance, box, spread)
        outward, random = members(wo, 3, "wo"), members(xi, 2, "xi")
        batch = Batch(outward, random, *p.arrays())
        wi, weight, pdf = batch.answers(3), batch.answers(3), batch.answers()
        self._handle.sample(p.of(batch), batch.rows(outward), batch.rows(random), wi, weight, pdf, threads)
        return batch.shaped(wi), batch.shaped(weight), batch.shaped(pdf)

    def lobes(
        self, uv, wo, axes, sharpness, amplitudes, *, sigma=None, covariance=None, box=None, cells: int = 3, threads: int = 0
    ) -> np.ndarray:
        """Radiance towards wo from lobes of light, without sampling: D is averaged over the half vectors of each lobe.

        A lobe is a spherical Gaussian, amplitude exp(sharpness (w . axis - 1)) from each direction w (Deng 2022, section 5.4).

        Args:
            axes: [..., lobes, 3] unit vectors of the tangent frame.
            sharpness: [..., lobes].
            amplitudes: [..., lobes, 3] radiance along the axis.
            cells: cells along each axis that a lobe is cut into, 1 to 8.

        Returns:
            [..., 3] radiance.
        """
        p, outward = self._footprints(uv, sigma, covariance, box), members(wo, 3, "wo")
        axes, amplitudes = members(axes, 3, "axes"), members(amplitudes, 3, "amplitudes")
        table = np.concatenate(_lobe_members(axes, sharpness, amplitudes), axis=-1)
        count = table.shape[-2]
        flat = table.reshape(table.shape[:-2] + (count * 7,))
        batch = Batch(outward, flat, *p.arrays())
        out = batch.answers(3)
        lobes = batch.rows(flat).reshape(batch.count, count, 7)
        self._handle.reflect_lobes(p.of(batch), batch.rows(outward), lobes, cells, out, threads)
        return batch.shaped(out)

    def __repr__(self) -> str:
        return f"<glint_ndf.Brdf of {self.ndf!r}>"


def _lobe_members(axes: np.ndarray, sharpness, amplitudes: np.ndarray) -> list[np.ndarray]:
    """Axis, sharpness and amplitude of lobes, all of the same leading shape."""
    sharp = members(sharpness, 1, "sharpness")
    try:
        shape = np.broadcast_shapes(axes.shape[:-1], sharp.shape[:-1], amplitudes.shape[:-1])
    except ValueError:
        raise ArgumentError(
            f"axes, sharpness and amplitudes do not broadcast: {axes.shape}, {sharp.shape[:-1]} and " f"{amplitudes.shape}"
        ) from None
    if not shape:
        raise ArgumentError("axes, sharpness and amplitudes: one of them must have a dimension of lobes, [..., lobes, 3]")
    return [np.broadcast_to(a, shape + a.shape[-1:]) for a in (axes, sharp, amplitudes)]


def open(
    source: PathLike | bytes | bytearray | memoryview | Asset,
    normals: PathLike | Asset | None = None,
    *,
    surface: str = "flat",
    boundary: str = "wrap",
    sigma_r: float = 0.005,
    alpha: float = 0.0,
    slant_tolerance: float = 0.06,
    gaussian_boxes: int = 1,
    footprint_parts: int = 32,
    interpolation: str = "footprint",
    pixels: str = "smooth",
    estimator: str = "exact",
    bins: str = "even",
    kept_normals: str = "used",
    verify_hashes: bool = False,
) -> Ndf:
    """Opens an asset that holds a distribution of normals. The file is checked, and then mapped. Options of other kinds are ignored.

    Args:
        source: a file, its bytes, or an `Asset`. Bytes go through a temporary file. "rock.<UDIM>.glint" opens every tile of a UDIM
            set that has a file: tile 1001 + floor(u) + 10 floor(v) holds uv. Densities are 0 where the set has no tile.
        normals: asset of kind normals that a pyramid was made from. It answers footprints below level 0. Without it, the normals
            that the pyramid keeps do, and the nearest level where it keeps none. Of a UDIM set a pattern, too.
        surface, boundary: kind normals: "flat" or "smooth", "wrap" or "clamp".
        sigma_r: kinds normals, slope-moments and histogram-sat: intrinsic roughness, disk units, 1e-4 to 0.25.
        alpha: kind bin-map: Beckmann roughness, in the range that the asset was made for; 0: the smallest.
        slant_tolerance: kind histogram-sat: share of a footprint with slanted sides that may be counted in a wrong place; 0: none.
        gaussian_boxes: kind histogram-sat: boxes that stand for a Gaussian footprint, 1 or 3.
        footprint_parts: kinds with levels: most round footprints that stand for a stretched one, 1 to 32.
        interpolation: kinds with levels: "footprint", or "trilinear" (quicker, and answers a wider footprint).
        pixels: kinds with levels: "smooth", or "constant" (quicker; small lights show the borders of pixels).
        estimator: kind bin-map: "exact", or "published" (densities by the centres of 21 bins: quicker, and less exact).
        bins: kind histogram-sat: where the normals of a bin are: "even" over the bin (small lights show the borders of bins), or
            "lobes" (with their mean and spread over the map; slower).
        kept_normals: kinds ndf-pyramid and ndf-cp: "used", or "ignored" (the asset answers as one that keeps no normals: to compare,
            or for speed).
        verify_hashes: compare all arrays with their hashes.

    Raises:
        FileError, InvalidInputError, UnsupportedError: as `load`.
        ArgumentError: an option is out of range.
    """
    asset = source if isinstance(source, Asset) else _asset_of_bytes(source)
    path = asset.path if asset is not None else os.fspath(source)
    options: dict[str, Any] = dict(
        sigma_r=sigma_r,
        surface=_word("surface", surface, _SURFACES),
        boundary=_word("boundary", boundary, _BOUNDARIES),
        alpha=alpha,
        slant_tolerance=_SLANT_EXACT if slant_tolerance == 0 else slant_tolerance,
        gaussian_boxes=gaussian_boxes,
        footprint_parts=footprint_parts,
        interpolation=_word("interpolation", interpolation, _INTERPOLATIONS),
        pixels=_word("pixels", pixels, _PIXELS),
        estimator=_word("estimator", estimator, _ESTIMATORS),
        bins=_word("bins", bins, _BINS),
        kept_normals=_word("kept_normals", kept_normals, _KEPT_NORMALS),
        verify_hashes=verify_hashes,
    )
    of_texels = None if normals is None else normals.path if isinstance(normals, Asset) else os.fspath(normals)
    return Ndf(_glint.open_ndf(path, of_texels, **options), asset, path)


def _asset_of_bytes(source) -> Asset | None:
    """An asset of the bytes of a file; None for names of files."""
    if not isinstance(source, (bytes, bytearray, memoryview)):
        return None
    asset = Asset.__new__(Asset)
    path = temporary_file(asset)
    Path(path).write_bytes(source)
    asset.__init__(path)
    return asset
