#include "glint-ingest/udim_ingest.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>

#include "common/memory_needs.h"
#include "glint-ingest/normals_output.h"
#include "glint/bake/common/slopes.h"
#include "glint/bake/ingest/tile_margins.h"

namespace glint::apps {
namespace {

using formats::UdimPlace;

/// Margins by themselves: a sixteenth of the tile, 64 texels or more, and at most a quarter of the tile. Footprints of up to .3 of it
/// are answered by one tile.
constexpr int kMarginParts = 16, kMostMarginParts = 4;
constexpr int kLeastMargin = 64;
/// Memory of a tile beside its pixels: normals or heights, bounds. Tiles do not go into temporary files.
constexpr double kBytesPerTexel = 32;

/// The texels of one image, of normals or of heights.
struct TileTexels {
  Image image;  ///< without its pixels
  bake::IngestReport report;
  std::optional<double> no_data;
  std::pmr::vector<Vec2> normals;
  std::pmr::vector<float> heights;

  double bytes() const { return static_cast<double>(normals.size() * sizeof(Vec2) + heights.size() * sizeof(float)); }
};

/// Reads tiles, and keeps those that will be needed again while memory allows.
class TileReader {
 public:
  TileReader(Tool& tool, const InputFile& input, const IngestOptions& options)
      : tool_(tool), input_(input), options_(options) {}

  bool has(int tile) const { return std::binary_search(input_.tiles().begin(), input_.tiles().end(), tile); }
  const TileTexels& at(int tile) {
    const auto found = read_.find(tile);
    return found != read_.end() ? found->second : read_.emplace(tile, read(tile)).first->second;
  }
  /// Forgets tiles that do not touch this one, while the tiles take more than a quarter of the memory.
  void keepNear(int tile) {
    const double most = 0.25 * static_cast<double>(tool_.maxMemory());
    double bytes = 0;
    for (const auto& [number, texels] : read_) bytes += texels.bytes();
    for (auto entry = read_.begin(); entry != read_.end() && bytes > most;) {
      const UdimPlace a{tile, {}}, b{entry->first, {}};
      const bool near = std::abs(a.column() - b.column()) <= 1 && std::abs(a.row() - b.row()) <= 1;
      if (!near) bytes -= entry->second.bytes();
      entry = near ? std::next(entry) : read_.erase(entry);
    }
  }

 private:
  TileTexels read(int tile) const {
    const std::string path = formats::udimFile(input_.path(), tile);
    TileTexels texels;
    texels.image = options_.read(tool_, path, false);
    const Image& image = texels.image;
    requireMemoryFor(tool_, "a tile of", image.width, image.height, kBytesPerTexel, "scale the images down");
    const bake::IngestOptions values = options_.tileValues(tool_, path, image);
    texels.no_data = values.no_data;
    if (options_.readsHeights()) {
      bake::IngestedHeights made = bake::ingestHeights(pixelArray(image), values);
      texels.heights = std::move(made.heights), texels.report = made.report;
    } else {
      bake::IngestedNormals made = bake::ingestNormals(pixelArray(image), values);
      texels.normals = std::move(made.normals), texels.report = made.report;
    }
    texels.image.pixels = {};
    return texels;
  }

  Tool& tool_;
  const InputFile& input_;
  const IngestOptions& options_;
  std::map<int, TileTexels> read_;
};

/// The number of the tile so many columns and rows further; 0 where there can be none.
int neighbourOf(const UdimPlace& place, int dx, int dy) {
  const int column = place.column() + dx, row = place.row() + dy;
  if (column < 0 || column >= formats::kUdimColumns || row < 0) return 0;
  const int tile = formats::kFirstUdim + column + formats::kUdimColumns * row;
  return tile <= formats::kLastUdim ? tile : 0;
}

/// Margins on the sides that have a neighbour. Beyond the others the set ends.
UdimPlace placeOf(const TileReader& tiles, int tile, int margin) {
  UdimPlace place{tile, {}};
  constexpr int kSides[4][2] = {{-1, 0}, {0, -1}, {1, 0}, {0, 1}};
  for (int side = 0; side < 4; ++side)
    if (tiles.has(neighbourOf(place, kSides[side][0], kSides[side][1]))) place.margins[static_cast<std::size_t>(side)] = margin;
  return place;
}

/// The texels of a tile and its margins.
/// @param texelsOf  texelsOf(tile): the array of a tile
template <class T, class TexelsOf>
std::vector<T> withMargins(TileReader& tiles, const UdimPlace& place, const TexelsOf& texelsOf) {
  bake::TileNeighbourhood<T> around;
  for (int dy = -1; dy <= 1; ++dy)
    for (int dx = -1; dx <= 1; ++dx) {
      const int number = dx == 0 && dy == 0 ? place.tile : neighbourOf(place, dx, dy);
      if (!tiles.has(number)) continue;
      const TileTexels& texels = tiles.at(number);
      around.at(dx, dy) = {texelsOf(texels), texels.image.width, texels.image.height};
    }
  return bake::withMargins(around, place.margins);
}

/// Heights are in texels of their own tile, so that tiles of several resolutions would not meet.
void requireOneResolution(TileReader& tiles, const UdimPlace& place, const std::string& path) {
  const Image& own = tiles.at(place.tile).image;
  for (int dy = -1; dy <= 1; ++dy)
    for (int dx = -1; dx <= 1; ++dx) {
      const int number = neighbourOf(place, dx, dy);
      if (!tiles.has(number)) continue;
      const Image& other = tiles.at(number).image;
      if (other.width == own.width && other.height == own.height) continue;
      throw Error(ErrorCode::unsupported, "udim.resolution", path, "",
                  fmt::format("has {} x {} heights, and the neighbouring tile {} has {} x {}", own.width, own.height, number,
                              other.width, other.height),
                  "scale the images of heights to one resolution; tiles of normals may have several");
    }
}

}  // namespace

UdimIngest::UdimIngest(Tool& tool, const InputFile& input, const OutputFile& output, const IngestOptions& options)
    : tool_(tool), input_(input), output_(output), options_(options) {
  tool.option("--udim-margin", margin_,
              "UDIM sets: texels of the neighbours that each tile gets; footprints of up to .3 of it are answered by one tile")
      .range(8, 4096)
      .defaultText("a sixteenth of the tile, 64 or more, at most a quarter");
}

void UdimIngest::run() const {
  TileReader tiles(tool_, input_, options_);
  const auto neighbours = [&](int tile) {
    std::vector<std::string> files;
    for (int dy = -1; dy <= 1; ++dy)
      for (int dx = -1; dx <= 1; ++dx)
        if (const int number = neighbourOf({tile, {}}, dx, dy); number != tile && tiles.has(number))
          files.push_back(formats::udimFile(input_.path(), number));
    return files;
  };
  const auto make = [&](const MapFiles& files) -> nlohmann::json {
    const TileTexels& own = tiles.at(files.tile);
    const int width = own.image.width, height = own.image.height, least = std::min(width, height);
    const int automatic = std::min(std::max(kLeastMargin, std::max(width, height) / kMarginParts), least / kMostMarginParts);
    const int margin = std::min(margin_ > 0 ? margin_ : std::max(automatic, 1), least);
    const UdimPlace place = placeOf(tiles, files.tile, margin);
    const int all_width = width + place.margins[0] + place.margins[2],
              all_height = height + place.margins[1] + place.margins[3];
    // The tile, its neighbours, and the map that is made of them.
    requireMemoryFor(tool_, "nine tiles of", all_width, all_height, kBytesPerTexel + 9 * sizeof(Vec2), "scale the images down");
    std::vector<Vec2> normals;
    std::vector<float> heights;
    if (options_.readsHeights()) {
      requireOneResolution(tiles, place, files.input);
      heights = withMargins<float>(
          tiles, place, [](const TileTexels& t) -> const auto& { return t.heights; });
      if (!options_.writesHeights()) {
        normals.resize(heights.size());
        bake::normalsFromHeights(all_width, all_height, heights, normals, Boundary::clamp);
      }
    } else {
      normals = withMargins<Vec2>(
          tiles, place, [](const TileTexels& t) -> const auto& { return t.normals; });
    }
    if (options_.writesHeights()) {
      formats::writeAsset(files.output, HeightMap{all_width, all_height, options_.texelSize(), heights}, files.provenance,
                          output_.writeOptions(place));
    } else {
      NormalMap map;
      map.width = all_width, map.height = all_height, map.normals = normals;
      writeNormals({files.output, files.provenance, output_.writeOptions(place)}, all_width, all_height, options_.texelSize(),
                   normals, bake::mapSlopes(map));
    }
    options_.warnAbout(tool_, files.input, own.no_data, Boundary::clamp, own.report);
    tool_.summary(reportText(files.input, own.image, own.report));
    nlohmann::json result = reportJson(own.report);
    result["margins_texels"] = place.margins;
    tiles.keepNear(files.tile);
    return result;
  };
  forEachMap(tool_, input_, output_, make, neighbours);
}

}  // namespace glint::apps
