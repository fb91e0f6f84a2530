#pragma once

#include <filesystem>

#include "glint/formats/asset_reader.h"
#include "glint/model/normal_map.h"
#include "glint/query/anisotropic_ndf.h"
#include "glint/query/bin_map_ndf.h"
#include "glint/query/histogram_ndf.h"
#include "glint/query/interpolation.h"

namespace glint::api {

/// How an asset is asked, where the asset does not say so itself. Options for other kinds are ignored.
struct NdfOptions {
  /// Asset that the pyramid was made from, for footprints below level 0; empty: the normals that the pyramid keeps, if it does.
  std::filesystem::path normals;
  Surface surface = Surface::flat;     ///< kind normals: how they behave between texels
  Boundary boundary = Boundary::wrap;  ///< kind normals: beyond the border of the map
  float sigma_r = 0.005f;              ///< kinds normals, slope-moments and histogram-sat: intrinsic roughness, disk units
  float alpha = 0;                     ///< kind bin-map: Beckmann roughness, in the range of the asset; 0: the smallest
  BinEstimator estimator = BinEstimator::exact;        ///< kind bin-map: how densities are made of the texels
  GaussianBoxes gaussian_boxes = GaussianBoxes::one;   ///< kind histogram-sat: boxes that stand for a Gaussian footprint
  HistogramBins histogram_bins = HistogramBins::even;  ///< kind histogram-sat: where the normals of a bin are
  float slant_tolerance = kSlantTolerance;  ///< kind histogram-sat: share of a slanted footprint that may be misplaced
  int footprint_parts =
      IsotropicParts::kMost;  ///< kinds ndf-pyramid, ndf-cp and slope-moments: most round footprints that stand
                              ///< for a stretched one; 1: one of the same mean square size
  /// Kinds ndf-pyramid and ndf-cp: how footprints between the stored ones are answered.
  Interpolation interpolation = Interpolation::footprint;
  /// Kinds ndf-pyramid and ndf-cp: how densities run between half vectors of one pixel.
  Pixels pixels = Pixels::smooth;
  /// Kinds ndf-pyramid and ndf-cp: whether the normals that the asset keeps answer footprints below level 0. Without them the asset
  /// answers as one that keeps none.
  bool use_kept_normals = true;
  formats::OpenOptions checks;  ///< checks of the asset and of `normals`
};

}  // namespace glint::api
