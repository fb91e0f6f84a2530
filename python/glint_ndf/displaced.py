"""Displacement maps at several levels of detail (Wu 2019)."""

from __future__ import annotations

import os

import numpy as np

from . import _glint
from ._arrays import Batch, members
from .assets import Asset, PathLike
from .ndf import _word

_VARIANTS = {"full": 0, "lobes": 1, "single": 2}


class Displaced:
    """A displacement map as coarse surfaces and the light that they reflect, shadowing and interreflections of all that is finer
    included. Made by `open_displaced`.

    `level` [...] is a level of detail: 1.25 is three parts of level 1 and one of level 2. `variant`: "full", "lobes" (no shadowing,
    no interreflections) or "single" (one Beckmann lobe with Smith's shadowing).
    """

    def __init__(self, handle: _glint.Displaced, asset: Asset | None, path: str):
        self._handle = handle
        self._asset = asset
        self.path = path  #: file that was opened
        for name, value in handle.info().items():
            setattr(self, name, value)

    width: int  #: of the original map, texels
    height: int  #: of the original map, texels
    level_count: int
    #: of each level: texels of the original along a side of a cell; about so many where they do not divide the map
    factors: list[int]
    channels: int  #: 3, or 1: red, green and blue are the same
    base: str  #: "diffuse", "ggx" or "table"
    texel_size_um: float  #: of the original; 0: unknown
    file_bytes: int  #: size of the asset

    def level(self, sigma) -> np.ndarray:
        """Level of detail for isotropic footprints of deviation `sigma` [...], texels of the original."""
        sigmas = members(sigma, 1, "sigma")
        batch = Batch(sigmas)
        out = batch.answers()
        self._handle.levels(batch.rows(sigmas), out)
        return batch.shaped(out)

    def heights(self, level: int) -> np.ndarray:
        """Coarse surface of a level: [rows][columns] heights in texels of the original, bottom row first, periodic. Read-only."""
        return self._handle.heights(level)

    def evaluate(self, level, uv, wi, wo, *, variant: str = "full", threads: int = 0) -> tuple[np.ndarray, np.ndarray]:
        """Light reflected from wi to wo, and the density of the samples.

        Returns:
            reflected: [..., 3] BRDF times the cosine between wi and the facet, 1/sr.
            pdf: [...] per unit solid angle.
        """
        levels, centre = members(level, 1, "level"), members(uv, 2, "uv", np.float64)
        inward, outward = members(wi, 3, "wi"), members(wo, 3, "wo")
        batch = Batch(levels, centre, inward, outward)
        reflected, pdf = batch.answers(3), batch.answers()
        self._handle.evaluate(
            _word("variant", variant, _VARIANTS),
            batch.rows(levels),
            batch.rows(centre),
            batch.rows(inward),
            batch.rows(outward),
            reflected,
            pdf,
            threads,
        )
        return batch.shaped(reflected), batch.shaped(pdf)

    def sample(
        self, level, uv, wo, xi, *, variant: str = "full", threads: int = 0
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Draws wi for views wo.

        Returns:
            wi: [..., 3]; weight: [..., 3] reflected / pdf; pdf: [...] per unit solid angle, 0 where nothing was drawn.
        """
        levels, centre = members(level, 1, "level"), members(uv, 2, "uv", np.float64)
        outward, random = members(wo, 3, "wo"), members(xi, 2, "xi")
        batch = Batch(levels, centre, outward, random)
        wi, weight, pdf = batch.answers(3), batch.answers(3), batch.answers()
        self._handle.sample(
            _word("variant", variant, _VARIANTS),
            batch.rows(levels),
            batch.rows(centre),
            batch.rows(outward),
            batch.rows(random),
            wi,
            weight,
            pdf,
            threads,
        )
        return batch.shaped(wi), batch.shaped(weight), batch.shaped(pdf)

    def __repr__(self) -> str:
        return f"<glint_ndf.Displaced, {self.width} x {self.height} texels, factors {self.factors}>"


def open_displaced(source: PathLike | Asset, verify_hashes: bool = False) -> Displaced:
    """Opens an asset of kind displacement. Errors as `open`."""
    asset = source if isinstance(source, Asset) else None
    path = asset.path if asset is not None else os.fspath(source)
    return Displaced(_glint.open_displaced(path, verify_hashes), asset, path)
