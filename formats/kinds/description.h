#pragma once

// Private to formats/: from the description of a kind to everything that is done with it.

#include "glint/formats/kinds/fields.h"
#include "glint/formats/kinds/kind.h"

namespace glint::formats {

/// The description of the kind whose assets are of struct `Model`. Each file of kinds/ specialises it and ends with
/// `template const Kind& kindOf<Model>();`. A description has
///
///   static constexpr std::string_view kTitle;                // of the kind, one line for people
///   static std::vector<Rule> indexRules(), valueRules();     // rules of this kind alone
///   static void describe(Fields auto& fields, auto& model);  // every attribute, then derived sizes, then every array, once
///   static void checkIndex(const Model&, Findings&);         // everything that a query follows
///   static void checkValues(const Model&, Findings&);
///
/// describe() calls a function of `fields` (the concept Fields) for each. It is called with a model that is constant, to write it
/// and to make the schema, and with one that is to be filled: fields.set() changes only the latter.
template <class Model>
struct KindDescription;

template <class Model>
Kind makeKind() {
  using Description = KindDescription<Model>;
  Kind kind;
  static_assert(!kKindName<Model>.empty(), "formats/kinds.h gives each kind a name");
  kind.schema.name = kKindName<Model>;
  kind.schema.title = Description::kTitle;
  const Model empty{};
  SchemaFields schema_fields(kind.schema);
  Description::describe(schema_fields, empty);
  kind.index_rules = Description::indexRules();
  kind.value_rules = Description::valueRules();
  kind.pack = [](const AnyAsset& asset) {
    PackFields fields(kKindName<Model>);
    Description::describe(fields, std::get<Model>(asset));
    return std::move(fields.packed());
  };
  kind.read = [](const FileStructure& file) {
    Model model;
    ReadFields fields(file);
    Description::describe(fields, model);
    return AnyAsset(model);
  };
  kind.check_index = [](const AnyAsset& asset, Findings& findings) {
    Description::checkIndex(std::get<Model>(asset), findings);
  };
  kind.check_values = [](const AnyAsset& asset, Findings& findings) {
    Description::checkValues(std::get<Model>(asset), findings);
  };
  return kind;
}

template <class Model>
const Kind& kindOf() {
  static const Kind kind = makeKind<Model>();
  return kind;
}

}  // namespace glint::formats
