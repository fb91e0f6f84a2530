#pragma once

#include <cstdint>
#include <vector>

#include "glint/api/models/ndf_traits.h"
#include "glint/api/ndf_model_list.h"
#include "glint/formats/udim.h"

namespace glint::api {

struct NdfModels;

/// A tile of a UDIM set. Its model answers a map that holds the tile and margins of texels of its neighbours; it must outlive the
/// tile.
struct UdimTile {
  formats::UdimPlace place;
  int width = 0;   ///< of the model's map, margins included, texels
  int height = 0;  ///< of the model's map, margins included, texels
  const OneOfNdfs<NdfModels>* model = nullptr;
};

/// The tiles of a set.
class UdimTiles {
 public:
  /// @param tiles  in the order of their numbers, one or more
  explicit UdimTiles(std::vector<UdimTile> tiles);

  const std::vector<UdimTile>& tiles() const { return tiles_; }
  /// Texels along u and v of the largest tile, without margins. Footprints are given in these texels.
  int width() const { return width_; }
  int height() const { return height_; }
  /// The tile of a column and row; nullptr where the set has none.
  const UdimTile* at(std::int64_t column, std::int64_t row) const;

 private:
  std::vector<UdimTile> tiles_;
  std::vector<int> places_;  ///< [rows][10]: index into tiles_, or -1
  int width_ = 0, height_ = 0;
};

/// The NDF of a UDIM set: uv counts tiles, tile = 1001 + floor(u) + 10 floor(v).
///
/// The tile that holds the centre of a footprint answers for all that its map covers, the tile and its margins, where that is most of
/// the footprint. Other tiles answer for the rest, each from its place nearest to the centre. Footprints much larger than the margins
/// weigh every tile by the share of the footprint in it. So the far field is the mean of the tiles' maps, which hold their margins:
/// tiles with margins count parts of others again. Weights where the set has no tile count for nothing, and the rest is
/// normalised. Shares are those of the Gaussian of the same variances along u and v. Centres where the set has no tile: density and
/// mean are 0, and nothing is drawn.
///
/// The tiles must outlive it. Thread-safe, allocates nothing; O(1) inside a tile, O(tiles) where a footprint reaches beyond the
/// margins.
class UdimNdf {
 public:
  explicit UdimNdf(const UdimTiles& tiles) : tiles_(&tiles) {}

  const UdimTiles& tiles() const { return *tiles_; }

  /// The set seen from another tile: uv (0, 0) is the lower left corner of the tile of this column and row.
  UdimNdf movedTo(std::int64_t column, std::int64_t row) const {
    UdimNdf moved = *this;
    moved.column_ = column, moved.row_ = row;
    return moved;
  }

  float density(const Footprint& p, Vec2 h) const;
  float mean(const Footprint& p, const Box2& range) const;
  /// Draws a tile by its weight, then a half vector of its model. The pdf is that of the mixture.
  HalfVectorSample sample(const Footprint& p, Vec2 xi) const;

 private:
  struct Centre;
  Centre centreOf(const Footprint& p) const;
  /// Calls visit(model, footprint of its map, weight) for each tile that has a share. Weights sum to 1.
  template <class Visit>
  void forEachPart(const Footprint& p, Visit&& visit) const;

  const UdimTiles* tiles_;
  std::int64_t column_ = 0, row_ = 0;
};

static_assert(NdfModel<UdimNdf>);

/// No asset holds a set, so that its traits are only what is asked of every model of AnyNdf.
template <>
struct NdfTraits<UdimNdf> {
  static constexpr bool kPacks = false;
};

}  // namespace glint::api
