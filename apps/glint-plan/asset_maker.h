#pragma once

#include <list>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "common/tool.h"
#include "glint/api/any_ndf.h"
#include "measure/asset_folder.h"
#include "measure/candidates.h"

namespace glint::apps {

/// An asset, and what it took to make it of the map.
struct MadeAsset {
  std::string file;
  double bytes = 0;    ///< of the asset alone
  double seconds = 0;  ///< with the asset that it is made from
  double reached = 0;  ///< seen error that its compression says to have; 0: it is not compressed
};

/// Makes the assets of one map by the programs of the package.
class AssetMaker {
 public:
  /// @param hash   of the map's file: names assets
  /// @param label  names assets too, so that those of parts of a map differ; may be empty
  /// @param path   the map, an asset of kind normals
  /// @param all    candidates, sources among them
  AssetMaker(Tool& tool, const AssetFolder& folder, std::string hash, std::string label, std::string path,
             std::vector<Candidate> all, float sigma_r);

  /// The asset of a candidate, which is made on the first call.
  /// @throws Error failed, with the message of the program that does not make it
  const MadeAsset& make(const Candidate& candidate);
  api::OpenedNdf open(const Candidate& candidate);
  /// The asset of a candidate so many times, with the map where it takes normals, each at other addresses. Fewer where the disk has
  /// no room. Copies have no names by the time they are returned.
  std::list<api::OpenedNdf> openCopies(const Candidate& candidate, int count);
  const std::vector<Candidate>& all() const { return all_; }

 private:
  /// @param map  given to candidates that take normals
  api::OpenedNdf openFile(const Candidate& candidate, const std::string& file, const std::string& map) const;
  /// @return name of a copy in the folder of assets; nothing where there is no room
  std::optional<std::string> copyOf(const std::string& file, int number) const;

  Tool& tool_;
  const AssetFolder& folder_;
  std::string hash_, label_, path_;
  std::vector<Candidate> all_;
  float sigma_r_;
  std::map<std::string, MadeAsset> made_;      ///< by names of candidates
  std::map<std::string, std::string> failed_;  ///< messages, so that nothing is tried twice
};

}  // namespace glint::apps
