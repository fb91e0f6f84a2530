#pragma once

#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "glint-farm/entry_lock.h"
#include "manifest/entry_records.h"
#include "manifest/hash_cache.h"
#include "manifest/manifest.h"

namespace glint::apps {

/// How one try to make an entry went.
struct EntryTry {
  enum class Outcome : unsigned char {
    made,       ///< a program made the asset
    unchanged,  ///< a program found the asset, whole and made as it should be
    known,      ///< another farm has made and recorded it meanwhile
    busy,       ///< another program makes it now
    stopped,    ///< a signal ended the program
    failed,     ///< see `error`
  };
  Outcome outcome = Outcome::failed;
  bool may_help_again = false;  ///< failed, for a reason that may go away
  int exit_code = 0;
  double wall_s = 0, cpu_s = 0;
  std::int64_t peak_bytes = 0;
  std::optional<EntryLock> lock;  ///< made or unchanged: held until the record is written
  nlohmann::ordered_json error;   ///< {"code", "rule", "path", "object", "message", "remedy"}, as --json has it
};

/// Makes entries of a manifest by the programs of the package.
/// @note thread-safe
class EntryMaker {
 public:
  /// @param flags    for every program, such as --threads
  /// @param recheck  ask the programs also where records say that an asset is there
  EntryMaker(const Manifest& manifest, EntryRecords& records, HashCache& hashes, std::vector<std::string> flags, bool recheck)
      : manifest_(manifest), records_(records), hashes_(hashes), flags_(std::move(flags)), recheck_(recheck) {}

  /// Whether records and stamps say that an entry is there, made of its maps as they are now.
  bool isKnown(const ManifestEntry& entry);

  /// Tries once to make an entry.
  EntryTry make(const ManifestEntry& entry);

 private:
  EntryTry runLocked(const ManifestEntry& entry, int lock);
  void makeLinks(const ManifestEntry& entry) const;

  const Manifest& manifest_;
  EntryRecords& records_;
  HashCache& hashes_;
  std::vector<std::string> flags_;
  bool recheck_;
};

}  // namespace glint::apps
