#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "glint/bake/displace/merl_table.h"
#include "glint/bake/displace/table_kernels.h"
#include "glint/model/displacement.h"
#include "glint/query/brdf/base_table.h"

namespace glint::bake {

/// An isotropic base BRDF given by numbers, at nodes of the coordinates of base_table.h: no angle is computed in a lookup.
///
/// The mean of the bins of azimuth phi_d and pi - phi_d is taken. So the BRDF is mirrored by the plane of the half vector and the
/// normal, as that of a material without a handedness is; in a measurement the difference is noise. Bins of 1 degree and
/// MERL's half angles keep their resolution; finer tables lose theirs.
class MeasuredBrdf {
 public:
  static constexpr int kSlices = 90;  ///< nodes along the difference
  static constexpr int kNodes = 108;  ///< nodes along each axis of tablePoint, which reaches beyond half angles of 90 degrees

  /// @throws Error invalid_input, rule merl.gain: a view is reflected more than twice the light that arrives
  explicit MeasuredBrdf(const MerlTable& table);

  int channels() const { return channels_; }             ///< 1 if the table is grey, else 3
  const TableNodes& nodes() const { return nodes_; }     ///< f
  const BaseBrdf& base() const { return base_; }         ///< kind `table`, with the roughness of the lobe for samples
  float diffuseShare() const { return diffuse_share_; }  ///< share of the samples that are drawn by the cosine
  /// The largest share of light that the BRDF reflects towards views at 10, 40 and 65 degrees; the brightest channel.
  double albedo() const { return albedo_; }

  /// f of two directions at a facet, 1 / sr; the same numbers where the BRDF is grey.
  Rgb value(const TablePair& pair, Vec3 normal) const;
  /// f at a place of tablePoint.
  Rgb value(float difference, Vec2 point) const;

  /// The tables of an asset: `BaseTable::values`.
  /// @param channels  of the asset: channels(), or 3
  /// @note O(kBaseTableHalf^4 kBaseTables): about a second. Does not depend on the number of threads
  std::vector<float> assetTables(int channels) const;

 private:
  void fitSamples();

  int channels_ = 1;
  TableNodes nodes_;
  BaseBrdf base_;
  float diffuse_share_ = 0;
  double albedo_ = 0;
};

/// Density of directions around the normal (0, 0, 1) that samples of a table have for a view: a mixture of the cosine and of
/// mirrored normals of a GGX lobe that the view sees.
/// @param share  of the cosine
float tableSamplePdf(float alpha, float share, Vec3 view, Vec3 direction);

}  // namespace glint::bake
