#pragma once

// Private to formats/: a kind of asset as reader, writer and validator use it.

#include <span>
#include <string_view>
#include <vector>

#include "glint/formats/findings.h"
#include "glint/formats/kinds.h"
#include "glint/formats/packed_asset.h"
#include "glint/formats/rules.h"
#include "glint/formats/schema.h"
#include "glint/formats/structure.h"

namespace glint::formats {

/// Everything that depends on the kind of an asset, made from its KindDescription.
struct Kind {
  KindSchema schema;
  std::vector<Rule> index_rules;  ///< rules that check_index checks
  std::vector<Rule> value_rules;  ///< rules that check_values checks

  /// Attributes and arrays to write. Throws Error (usage) if an array has another size than the struct says.
  PackedAsset (*pack)(const AnyAsset&);
  /// The struct of a file that agrees with the schema.
  AnyAsset (*read)(const FileStructure&);
  /// Checks everything that a query follows, so that no query can read out of bounds. Cost: the bytes of the index arrays.
  void (*check_index)(const AnyAsset&, Findings&);
  /// Checks the values. Called after check_index has passed.
  void (*check_values)(const AnyAsset&, Findings&);
};

/// The kind whose assets are of struct `Model`, an alternative of AnyAsset. Each is made in the file that describes it.
template <class Model>
const Kind& kindOf();

/// All kinds, in the order of AnyAsset.
std::span<const Kind* const> kinds();

/// The kind of this name, or nullptr.
const Kind* findKind(std::string_view name);

}  // namespace glint::formats
