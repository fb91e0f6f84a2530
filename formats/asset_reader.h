#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "glint/formats/kinds.h"
#include "glint/formats/provenance.h"
#include "glint/formats/schema.h"
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
  std::uint64_t file_bytes = 0;
  std::vector<AttributeInfo> attributes;  ///< of the kind, in the order of SPEC.md
  std::vector<DatasetInfo> datasets;      ///< by path
  std::vector<std::string> warnings;      ///< things that a reader tolerates, e.g. a newer minor version
};

struct OpenOptions {
  bool verify_hashes =
      false;  ///< also compare datasets with their hashes, and bytes between objects with 0; reads the whole file
  bool check_values = false;  ///< also check values as validateAsset() does (finite, in the disk, ...); reads the whole file
};

/// An asset of any kind, mapped read-only. The structs that it returns point into the mapping and live as long as it does.
///
/// Safe on untrusted input: the structure and every index that a query follows are checked by open(), so no query reads out of
/// bounds, and answers are finite whatever the values are; values (finite, in the disk) are checked by openForBuilding() and
/// validateAsset() only. The file must not be changed or truncated in place while it is open: the writers of this library never
/// do, they replace files.
class Asset {
 public:
  /// Opens and checks an asset. HDF5 is not used after this returns.
  /// @throws Error  io: cannot be opened; invalid_input: breaks a rule (its id is in the error); unsupported: a newer major
  ///                version, an unknown feature or kind
  /// @note O(size of the index arrays); with verify_hashes O(file). Thread-safe: one file is opened at a time.
  static Asset open(const std::filesystem::path& path, const OpenOptions& options = {});

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

 private:
  struct State;
  explicit Asset(std::unique_ptr<State> state);
  [[noreturn]] void refuse(const AnyAsset& wanted) const;

  std::unique_ptr<State> state_;
};

}  // namespace glint::formats
