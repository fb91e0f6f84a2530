#pragma once

#include <functional>
#include <string>
#include <unordered_map>
#include <vector>

namespace glint::apps {

/// A file that no entry of the manifest makes: an image, or an asset that was there.
struct ManifestMap {
  std::string file;  ///< as the folder of the manifest sees it
  std::string hash;  ///< formats::hashFile of its bytes when it was planned
};

/// One asset to make.
struct ManifestEntry {
  std::string key;     ///< hash of what decides the bytes: version, program, flags, and hashes of maps or keys of inputs
  std::string output;  ///< the asset
  std::vector<std::string> links;    ///< further names of the same asset, of maps with the same bytes
  std::vector<std::string> twins;    ///< these maps, as far as the entry would read them itself
  std::vector<std::string> command;  ///< program of this package, and arguments; it runs in the folder of the manifest
  std::vector<std::string> inputs;   ///< files that it reads
  std::vector<std::string> after;    ///< keys of entries, before this one, that make some of them
};

/// Which assets to make, how, and of what: docs/json/files/farm-manifest.schema.json. All files are named as the folder of the
/// manifest sees them.
struct Manifest {
  std::string path;
  std::string folder;     ///< of the manifest, from here; "." at least
  std::string generator;  ///< tool and version that planned it
  std::vector<ManifestMap> maps;
  std::vector<ManifestEntry> entries;
  std::unordered_map<std::string, std::size_t> entry_of_key;
  std::unordered_map<std::string, std::string> hash_of_map;

  /// The name of a file from here.
  std::string at(const std::string& file) const;
  /// Where the states of entries are kept: the manifest's own name and ".log".
  std::string logPath() const { return path + ".log"; }
  /// Where hashes of maps are kept.
  std::string hashesPath() const { return path + ".hashes"; }
  /// Fills entry_of_key and hash_of_map.
  void index();
};

/// The folder of a manifest, from here.
std::string manifestFolder(const std::string& path);

/// @throws Error io; invalid_input if the file is no manifest of this form, or would run anything but programs of this package
Manifest readManifest(const std::string& path);

/// The key of an entry, from its command, inputs and output.
/// @param generator  of the manifest
/// @param source_of  what an input is: sourceOfMap, or the key of the entry that makes it
std::string keyOf(const std::string& generator, const ManifestEntry& entry,
                  const std::function<std::string(const std::string&)>& source_of);

/// What a map is in a key: the hash of its bytes, and the ending of its name.
std::string sourceOfMap(const std::string& file, const std::string& hash);

/// Checks that entries are as glint-farm plan wrote them: an entry that was changed by hand would be recorded as what it is not.
/// @throws Error invalid_input
void requireKeys(const Manifest& manifest);

/// The text of the file.
std::string manifestText(const Manifest& manifest);

}  // namespace glint::apps
