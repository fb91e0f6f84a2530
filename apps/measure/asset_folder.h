#pragma once

#include <optional>
#include <string>

#include "common/signals.h"

namespace glint::apps {

/// The folder for the assets of a bench or a plan, which is made if it is missing. Assets have names of their own there, so that only
/// they are ever removed. Signals that end the process remove a folder that the end of the scope removes.
class AssetFolder {
 public:
  /// @param remove  remove the folder and its assets at the end of the scope; then it must be new, or hold only what an earlier bench
  ///                left
  /// @throws Error io; usage if the folder would be removed and holds other files
  AssetFolder(const std::string& path, bool remove);
  AssetFolder(const AssetFolder&) = delete;
  AssetFolder& operator=(const AssetFolder&) = delete;
  ~AssetFolder();

  /// A new folder BASE.assets-NUMBER, which is removed at the end of the scope. Also removes the folders of this base that killed
  /// processes have left.
  ///
  /// A file in the folder is locked as long as its process lives, or a program that the process gave lock() to. Only folders whose
  /// file this process can lock are removed, so processes of other containers keep theirs, and those of other machines where the file system
  /// shares locks. Where there are no locks, no folder is removed.
  /// @throws Error io
  static AssetFolder temporary(const std::string& base);

  /// The file of the asset that a candidate of this name has of a map.
  std::string fileOf(const std::string& map_hash, const std::string& candidate) const;

  /// The open file whose lock keeps the folder, for ChildOptions::shared_file; -1: the folder has none.
  int lock() const { return lock_; }

  const std::string& path() const { return path_; }

  /// Removes the assets of a map, if the folder is to be removed.
  void finish(const std::string& map_hash) const;

 private:
  struct Locked;
  explicit AssetFolder(const Locked& made);
  void holdLock();
  void removeAtSignals();

  std::string path_;
  bool remove_;
  int lock_ = -1;
  std::optional<EndScope> end_;
};

}  // namespace glint::apps
