#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "glint/formats/kinds.h"
#include "glint/formats/provenance.h"
#include "glint/formats/schema.h"
#include "glint/formats/udim.h"
#include "glint/model/error.h"

namespace glint::formats {

/// One dataset of an asset.
struct DatasetInfo {
  std::string path;  ///< with the leading '/'
  std::string type;  ///< as in SPEC.md, e.g. "f32"; "unknown" if no kind uses it
  std::vector<std::uint64_t> dims;
  std::uint64_t size_bytes = 0;
  std::uint64_t offset = 0;  ///< from the start of the file
  std::string hash_hex;      ///< as stored; not compared with the bytes
  std::string units;
  std::string long_name;
};

/// One attribute of an asset's kind.
struct AttributeInfo {
  std::string name;  ///< as in SPEC.md
  std::string type;  ///< "i32", "f32" or "text"
  bool scalar = true;
  bool of_levels = false;       ///< one value for each level
  std::vector<double> numbers;  ///< empty for texts
  std::vector<std::string> texts;
  std::string units;
  std::string long_name;
};

/// What a file says about itself.
struct AssetInfo {
  std::string kind;
  int format_major = 0;
  int format_minor = 0;
  std::vector<std::string> required_features;
  Provenance provenance;
  std::optional<UdimPlace> udim;  ///< tile of a UDIM set that the asset covers; nothing where it is a map of its own
  std::uint64_t file_bytes = 0;
  std::vector<AttributeInfo> attributes;  ///< of the kind, in the order of SPEC.md
  std::vector<DatasetInfo> datasets;      ///< by path
  std::vector<std::string> warnings;      ///< things that a reader tolerates, e.g. a newer minor version
};

struct OpenOptions {
  bool verify_hashes =
      false;  ///< also compare datasets with their hashes, and bytes between objects with 0; reads the whole file
  bool check_values = false;  ///< also check values as validateAsset() does (finite, in the disk, ...); reads the whole file
  /// Copy the bytes into memory instead of using them in place: for files that others may change or truncate while they are open,
  /// and for memory that does not stay.
  bool copy = false;
  /// Read the file in pieces to compare hashes, instead of its map: for assets that are larger than memory, whose pages in the map
  /// would all count as memory of the process.
  bool hash_in_pieces = false;
};

/// Bytes of an asset that are neither a file nor in memory, for example a part of an archive.
struct AssetSource {
  std::string name;        ///< name of the asset in messages
  std::uint64_t size = 0;  ///< bytes of the asset
  /// Fills `to` with the bytes from `offset` on. Called for ranges inside the asset only. Returns false where reading fails.
  std::function<bool(std::uint64_t offset, std::span<std::byte> to)> read;
};

/// An asset of any kind, mapped read-only. The structs that it returns point into the mapping and live as long as it does.
///
/// Safe on untrusted input: the structure and every index that a query follows are checked by open(), so no query reads out of
/// bounds, and answers are finite whatever the values are; values (finite, in the disk) are checked by openForBuilding() and
/// validateAsset() only. A file that is mapped must not be changed or truncated in place while it is open: the writers of this
/// library never do, they replace files. Open files that others may truncate with OpenOptions::copy.
class Asset {
 public:
  /// Opens and checks an asset.
  /// @throws Error  io: cannot be opened; invalid_input: breaks a rule (its id is in the error); unsupported: a newer major
  ///                version, an unknown feature or kind
  /// @note O(size of the index arrays); with verify_hashes or copy O(file). Thread-safe
  static Asset open(const std::filesystem::path& path, const OpenOptions& options = {});

  /// The same for the bytes of a file in memory, which must stay unchanged as long as the asset. They are copied with
  /// OpenOptions::copy, and where they do not start at a multiple of 64.
  /// @param name  name of the asset in messages
  static Asset openMemory(std::span<const std::byte> bytes, const std::string& name, const OpenOptions& options = {});

  /// The same for bytes that a function reads. All bytes are read into memory before this returns.
  static Asset openSource(const AssetSource& source, const OpenOptions& options = {});

  /// Opens an asset to make something of all that it holds: builders trust their inputs, so hashes and values are checked, too.
  /// @throws Error  as open(); invalid_input also for values, naming the first texel that is wrong
  /// @note O(file)
  static Asset openForBuilding(const std::filesystem::path& path) { return open(path, {true, true}); }

  Asset(Asset&&) noexcept;
  Asset& operator=(Asset&&) noexcept;
  ~Asset();

  /// Name of the kind, e.g. "ndf-pyramid".
  std::string_view kind() const;
  const AssetInfo& info() const;

  /// The asset as the struct of its kind, e.g. get<NdfPyramid>(). Throws Error (unsupported) that names both kinds if the asset is
  /// of another one.
  template <class Model>
  const Model& get() const {
    const Model* asset = std::get_if<Model>(&any());
    if (asset == nullptr) refuse(Model());
    return *asset;
  }

  /// The asset as a variant of all kinds, for std::visit.
  const AnyAsset& any() const;

  /// Leaves out the normals that a pyramid keeps for footprints below level 0: the asset is then as one that keeps none. No effect
  /// on other kinds. Models made before still use them.
  void leaveOutNearNormals();

 private:
  struct State;
  explicit Asset(std::unique_ptr<State> state);
  static Asset checked(std::unique_ptr<State> state, const OpenOptions& options);
  [[noreturn]] void refuse(const AnyAsset& wanted) const;

  std::unique_ptr<State> state_;
};

}  // namespace glint::formats
