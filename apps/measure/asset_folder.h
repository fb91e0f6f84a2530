#pragma once

#include <string>

namespace glint::apps {

/// The folder for the assets of a bench, which is made if it is missing. Assets have names of their own there, so that only they are
/// ever removed.
class AssetFolder {
 public:
  /// @param remove  remove the folder and its assets at the end of the scope; then it must be new, or hold only what an earlier bench
  ///                left
  /// @throws Error io; usage if the folder would be removed and holds other files
  AssetFolder(const std::string& path, bool remove);
  AssetFolder(const AssetFolder&) = delete;
  AssetFolder& operator=(const AssetFolder&) = delete;
  ~AssetFolder();

  /// The file of the asset that a candidate of this name has of a map.
  std::string fileOf(const std::string& map_hash, const std::string& candidate) const;

  /// Removes the assets of a map, if the folder is to be removed.
  void finish(const std::string& map_hash) const;

 private:
  std::string path_;
  bool remove_;
};

}  // namespace glint::apps
