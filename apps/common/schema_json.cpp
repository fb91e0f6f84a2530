#include "common/schema_json.h"

#include <nlohmann/json.hpp>

#include "glint/formats/schema.h"

namespace glint::apps {
namespace {

using nlohmann::ordered_json;
using namespace glint::formats;

ordered_json attributeJson(const AttributeSchema& attribute) {
  ordered_json json = {{"name", attribute.name}, {"type", name(attribute.type)}};
  if (!attribute.count.empty()) json["count"] = attribute.count;
  if (attribute.type != ElementType::text) json["range"] = {attribute.minimum, attribute.maximum};
  if (!attribute.values.empty()) json["values"] = attribute.values;
  if (!attribute.required) json["required"] = false;
  if (!attribute.needs.empty()) json["needs"] = attribute.needs;
  if (attribute.since > 0) json["since_minor"] = attribute.since;
  json["units"] = attribute.units;
  json["long_name"] = attribute.long_name;
  return json;
}

template <class Attributes>
ordered_json attributesJson(const Attributes& attributes) {
  ordered_json list = ordered_json::array();
  for (const AttributeSchema& attribute : attributes) list.push_back(attributeJson(attribute));
  return list;
}

ordered_json datasetJson(const DatasetSchema& dataset) {
  ordered_json json = {{"path", dataset.path}};
  if (!dataset.repeat.empty()) json["repeat"] = dataset.repeat;
  ordered_json types = ordered_json::array();
  for (const TypeChoice& choice : dataset.types) {
    ordered_json type = {{"type", name(choice.type)}};
    if (!choice.when.empty()) type["when"] = choice.when;
    types.push_back(std::move(type));
  }
  json["types"] = std::move(types);
  json["dims"] = dataset.dims;
  json["required"] = dataset.required;
  if (!dataset.needs.empty()) json["needs"] = dataset.needs;
  if (dataset.since > 0) json["since_minor"] = dataset.since;
  json["units"] = dataset.units;
  json["long_name"] = dataset.long_name;
  return json;
}

ordered_json kindJson(const KindSchema& kind) {
  ordered_json json = {{"kind", kind.name}, {"title", kind.title}, {"attributes", attributesJson(kind.attributes)}};
  json["derived"] = ordered_json::array();
  for (const DerivedValue& derived : kind.derived) {
    json["derived"].push_back({{"name", derived.name}, {"expression", derived.expression}, {"long_name", derived.long_name}});
  }
  json["datasets"] = ordered_json::array();
  for (const DatasetSchema& dataset : kind.datasets) json["datasets"].push_back(datasetJson(dataset));
  return json;
}

}  // namespace

ordered_json schemaJson() {
  ordered_json json = {{"format_major", kFormatMajor},
                       {"format_minor", kFormatMinor},
                       {"root_attributes", attributesJson(commonAttributes())},
                       {"dataset_attributes", attributesJson(datasetAttributes())}};
  json["kinds"] = ordered_json::array();
  for (const KindSchema* kind : kindSchemas()) json["kinds"].push_back(kindJson(*kind));
  return json;
}

std::string schemaText() { return schemaJson().dump(1) + "\n"; }

}  // namespace glint::apps
