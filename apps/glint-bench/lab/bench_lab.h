#pragma once

#include <list>
#include <map>
#include <string>
#include <vector>

#include "common/tool.h"
#include "glint/api/any_ndf.h"
#include "glint/bake/ingest/ingest.h"
#include "glint/bake/synth/synth.h"
#include "glint/formats/asset_reader.h"
#include "measure/asset_folder.h"
#include "measure/candidates.h"

namespace glint::apps {

/// A map of a test: an asset of kind normals.
struct LabMap {
  std::string id;  ///< 8 digits
  std::string path;
  formats::Asset asset;
  const NormalMap& normals() const { return asset.get<NormalMap>(); }
};

/// How assets of a map are made and asked.
struct LabQuestion {
  float sigma_r = 0.005f;              ///< intrinsic roughness of every method that has one, disk units
  Surface surface = Surface::flat;     ///< of the truth and of pyramids
  bool normals_below_level_0 = false;  ///< pyramids answer small footprints from the map
};

/// Makes the maps and assets of tests of stability and of presets.
class BenchLab {
 public:
  BenchLab(Tool& tool, const AssetFolder& folder, bool quick) : tool_(tool), folder_(folder), quick_(quick) {}

  /// Texels of a map along each axis.
  int mapSize() const { return quick_ ? 256 : 512; }
  /// Places of a test.
  std::size_t places() const { return quick_ ? 6 : 12; }
  std::uint64_t seed() const { return tool_.seed(); }

  /// The methods that most tests compare: the defaults of the bench, and its compression of the paper.
  static std::vector<Candidate> methods();

  /// Options of a typical map of a kind, of mapSize texels.
  bake::SynthOptions typical(bake::SynthKind kind) const;

  /// A synthetic map, which is made on the first call. It lives until `forget`.
  const LabMap& map(const bake::SynthOptions& options);
  /// A map of these normals, [height][width].
  const LabMap& map(int width, int height, std::span<const Vec2> normals);

  /// The truth: brute force over the texels of a map.
  static api::OpenedNdf truth(const LabMap& map, const LabQuestion& question = {});

  /// The asset of a method, which is made if it is missing.
  /// @throws Error failed, with the message of the program that does not make it
  api::OpenedNdf open(const LabMap& map, const Candidate& method, const LabQuestion& question = {});

  /// Seconds that the program of a method took, without the asset that its own is made from; makes it if it is missing.
  double secondsOf(const LabMap& map, const Candidate& method, const LabQuestion& question = {});
  /// Bytes of its file.
  double bytesOf(const LabMap& map, const Candidate& method, const LabQuestion& question = {});

  /// Removes all maps and assets.
  void forget();

 private:
  std::string assetOf(const LabMap& map, const Candidate& method, const LabQuestion& question) const;
  void make(const LabMap& map, const Candidate& method, const LabQuestion& question);

  Tool& tool_;
  const AssetFolder& folder_;
  bool quick_;
  int map_count_ = 0;
  std::list<LabMap> maps_;
  std::map<std::string, const LabMap*> synthetic_;  ///< by their options
  std::map<std::string, double> made_;              ///< files of assets, and the seconds that they took
};

}  // namespace glint::apps
