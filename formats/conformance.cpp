#include "glint/formats/conformance.h"

#include <algorithm>
#include <set>

#include "glint/formats/choices.h"
#include "glint/formats/number_text.h"
#include "glint/formats/size_expression.h"
#include "glint/formats/udim.h"

namespace glint::formats {
namespace {

std::string listed(const std::vector<std::uint64_t>& dims) {
  std::string text = "[";
  for (const std::uint64_t n : dims) text += (text.size() > 1 ? ", " : "") + std::to_string(n);
  return text + "]";
}

/// Minor version of the format that the file has; 0 where it does not say.
int minorOf(const Attributes& root) {
  const auto found = root.find("format_minor");
  if (found == root.end() || found->second.type != ElementType::i32 || found->second.numbers.empty()) return 0;
  return static_cast<int>(found->second.numbers[0]);
}

/// Checks an attribute that is there. Returns whether it can be used.
bool checkValue(const AttributeValue& value, const std::string& object, const AttributeSchema& schema, const SizeScope& scope,
                Findings& findings) {
  const std::string place = object + "@" + std::string(schema.name);
  if (value.type != schema.type) {
    findings.add("attribute.type", place, "is " + std::string(name(value.type)) + ", not " + std::string(name(schema.type)));
    return false;
  }
  const bool scalar = schema.count.empty();
  const auto count = scalar ? 1 : schema.count == "*" ? value.count() : evaluateSize(schema.count, scope).value_or(0);
  if (value.scalar != scalar || value.count() != count) {
    findings.add("attribute.type", place,
                 "has " + std::to_string(value.count()) + " elements" + (value.scalar ? " (scalar)" : "") + ", not " +
                     (scalar ? "a scalar" : "a list of " + std::to_string(count)));
    return false;
  }
  // Written so that NaN fails.
  const auto in_range = [&](double number) { return number >= schema.minimum && number <= schema.maximum; };
  if (!std::all_of(value.numbers.begin(), value.numbers.end(), in_range)) {
    const double bad = *std::find_if_not(value.numbers.begin(), value.numbers.end(), in_range);
    findings.add("attribute.value", place,
                 "is " + numberText(bad) + ", outside " + numberText(schema.minimum) + " to " + numberText(schema.maximum));
    return false;
  }
  for (const std::string& text : value.texts) {
    if (schema.values.empty() || indexOf(text, schema.values) >= 0) continue;
    findings.add("attribute.value", place, "is \"" + text + "\", not one of " + std::string(schema.values));
    return false;
  }
  return true;
}

/// Checks one attribute of a file of a minor version. Returns whether it can be used, or does not have to be there.
bool checkAttribute(const Attributes& attributes, const std::string& object, const AttributeSchema& schema,
                    const SizeScope& scope, int minor, Findings& findings) {
  const auto found = attributes.find(schema.name);
  const bool with_others = schema.needs.empty() || attributes.contains(schema.needs);
  if (found != attributes.end()) {
    if (with_others) return checkValue(found->second, object, schema, scope, findings);
    findings.add("attribute.unknown", object + "@" + std::string(schema.name),
                 "is not in the schema without " + std::string(schema.needs));
    return true;
  }
  const bool wanted = schema.needs.empty() ? schema.required : with_others;
  if (!wanted || schema.since > minor) return true;
  findings.add("attribute.missing", object + "@" + std::string(schema.name), "is missing");
  return false;
}

void warnOfUnknown(const Attributes& attributes, const std::string& object, std::span<const AttributeSchema> common,
                   std::span<const AttributeSchema> own, Findings& findings) {
  for (const auto& [attribute, value] : attributes) {
    const auto same = [&, &key = attribute](const AttributeSchema& schema) { return schema.name == key; };
    if (std::none_of(common.begin(), common.end(), same) && std::none_of(own.begin(), own.end(), same)) {
      findings.add("attribute.unknown", object + "@" + attribute, "is not in the schema");
    }
  }
}

/// Checks that a tile of a UDIM set is described in full, and that its margins leave texels to the tile.
bool checkUdim(const Attributes& root, const SizeScope& scope, Findings& findings) {
  const auto features = root.find("required_features");
  const bool named =
      features != root.end() && std::count(features->second.texts.begin(), features->second.texts.end(), kUdimFeature) > 0;
  const auto tile = root.find("udim"), margins = root.find("udim_margins");
  if (!named && tile == root.end() && margins == root.end()) return true;
  if (!named) {
    findings.add("attribute.value", "/@required_features",
                 "does not name the feature \"" + std::string(kUdimFeature) + "\", which the attributes of a tile require");
    return false;
  }
  for (const char* wanted : {"udim", "udim_margins"}) {
    if (root.contains(wanted)) continue;
    findings.add("attribute.missing", "/@" + std::string(wanted), "is missing");
    return false;
  }
  const std::vector<double>& m = margins->second.numbers;
  for (const auto& [size, beside] : {std::pair{"width", m[0] + m[2]}, std::pair{"height", m[1] + m[3]}}) {
    const auto found = scope.values.find(size);
    if (found != scope.values.end() && found->second.size() == 1 && beside < static_cast<double>(found->second[0])) continue;
    findings.add("attribute.value", "/@udim_margins", "leaves no texel of the " + std::string(size) + " to the tile");
    return false;
  }
  return true;
}

/// Checks root attributes and derives the values that sizes are made of. Returns whether datasets can be checked.
bool checkRoot(const FileStructure& structure, const KindSchema& schema, SizeScope& scope, Findings& findings) {
  bool usable = true;
  const int minor = minorOf(structure.attributes);
  for (const AttributeSchema& attribute : commonAttributes()) {
    usable &= checkAttribute(structure.attributes, "/", attribute, scope, minor, findings);
  }
  for (const AttributeSchema& attribute : schema.attributes) {
    if (!checkAttribute(structure.attributes, "/", attribute, scope, minor, findings)) {
      usable = false;
      continue;
    }
    const auto found = structure.attributes.find(attribute.name);
    if (attribute.type != ElementType::i32 || found == structure.attributes.end()) continue;
    if (!attribute.needs.empty() && !structure.attributes.contains(attribute.needs)) continue;
    std::vector<std::uint64_t>& values = scope.values[std::string(attribute.name)];
    for (const double number : found->second.numbers) {
      values.push_back(static_cast<std::uint64_t>(number));
    }
  }
  warnOfUnknown(structure.attributes, "/", commonAttributes(), schema.attributes, findings);
  usable = usable && checkUdim(structure.attributes, scope, findings);
  for (const DerivedValue& derived : schema.derived) {
    if (!usable) break;
    scope.values[std::string(derived.name)] = {evaluateSize(derived.expression, scope).value_or(0)};
  }
  return usable;
}

/// Checks one dataset; binds size names that no attribute gives.
void checkDataset(const DatasetRecord& record, const std::string& path, const DatasetSchema& schema, const Attributes& root,
                  SizeScope& scope, Findings& findings) {
  const std::string object = "/" + path;
  for (const AttributeSchema& attribute : datasetAttributes()) {
    checkAttribute(record.attributes, object, attribute, scope, minorOf(root), findings);
  }
  warnOfUnknown(record.attributes, object, datasetAttributes(), {}, findings);
  const auto type =
      std::find_if(schema.types.begin(), schema.types.end(), [&](const TypeChoice& c) { return conditionHolds(c.when, root); });
  if (type == schema.types.end() || !record.known_type || record.type != type->type) {
    findings.add("dataset.type", object,
                 "has elements of type " + std::string(record.known_type ? name(record.type) : "unknown") + ", not " +
                     std::string(type == schema.types.end() ? "any" : name(type->type)));
  }
  std::vector<std::uint64_t> expected;
  for (std::size_t d = 0; d < schema.dims.size(); ++d) {
    auto size = evaluateSize(schema.dims[d], scope);
    if (!size && d < record.dims.size()) {
      size = record.dims[d];
      scope.values[std::string(schema.dims[d])] = {*size};
    }
    expected.push_back(size.value_or(0));
  }
  if (record.dims != expected) {
    findings.add("dataset.dims", object, "has sizes " + listed(record.dims) + ", not " + listed(expected));
  }
}

}  // namespace

const KindSchema* checkHeader(const FileStructure& structure, Findings& findings) {
  const SizeScope scope;
  const auto attribute = [&](std::string_view wanted) -> const AttributeValue* {
    for (const AttributeSchema& schema : commonAttributes()) {
      if (schema.name != wanted) continue;
      // glint_format has its own rule for its value.
      AttributeSchema relaxed = schema;
      if (wanted == "glint_format") relaxed.values = {};
      // What every version has: without it, the version is not known either.
      relaxed.since = 0;
      if (!checkAttribute(structure.attributes, "/", relaxed, scope, 0, findings)) return nullptr;
    }
    return &structure.attributes.find(wanted)->second;
  };
  const AttributeValue* format = attribute("glint_format");
  if (format == nullptr) return nullptr;
  if (format->texts[0] != "glint") {
    findings.add("format.name", "/@glint_format", "is \"" + format->texts[0] + "\", not \"glint\"");
    return nullptr;
  }
  const AttributeValue* major = attribute("format_major");
  const AttributeValue* minor = attribute("format_minor");
  if (major == nullptr || minor == nullptr) return nullptr;
  const std::string version =
      std::to_string(static_cast<int>(major->numbers[0])) + "." + std::to_string(static_cast<int>(minor->numbers[0]));
  const std::string own = std::to_string(kFormatMajor) + "." + std::to_string(kFormatMinor);
  if (major->numbers[0] != kFormatMajor) {
    findings.add("format.major", "/@format_major", "has format version " + version + ", this reader knows " + own);
    return nullptr;
  }
  if (minor->numbers[0] > kFormatMinor) {
    findings.add("format.minor", "/@format_minor", "has format version " + version + ", this reader knows " + own);
  }
  const AttributeValue* features = attribute("required_features");
  if (features == nullptr) return nullptr;
  bool known = true;
  for (const std::string& feature : features->texts) {
    if (feature == kUdimFeature) continue;
    findings.add("format.feature", "/@required_features", "requires the unknown feature \"" + feature + "\"");
    known = false;
  }
  const AttributeValue* kind = attribute("kind");
  if (kind == nullptr || !known) return nullptr;
  const KindSchema* schema = findKindSchema(kind->texts[0]);
  if (schema == nullptr)
    findings.add("format.kind", "/@kind", "is \"" + kind->texts[0] + "\", a kind that this reader does not know");
  return schema;
}

void checkConformance(const FileStructure& structure, const KindSchema& schema, Findings& findings) {
  SizeScope scope;
  if (!checkRoot(structure, schema, scope, findings)) return;
  std::set<std::string> known;
  for (std::size_t place = 0; place < schema.datasets.size(); ++place) {
    // Names that no attribute gives are bound per level, so all datasets of a level are checked together.
    const DatasetSchema& first = schema.datasets[place];
    std::size_t end = place + 1;
    while (!first.repeat.empty() && end < schema.datasets.size() && schema.datasets[end].repeat == first.repeat) ++end;
    const auto levels = first.repeat.empty() ? 1 : evaluateSize(first.repeat, scope).value_or(0);
    for (std::uint64_t level = 0; level < levels; ++level) {
      SizeScope level_scope = scope;
      level_scope.level = level;
      SizeScope& use = first.repeat.empty() ? scope : level_scope;
      for (std::size_t k = place; k < end; ++k) {
        const DatasetSchema& dataset = schema.datasets[k];
        if (!dataset.needs.empty() && !structure.attributes.contains(dataset.needs)) continue;
        const std::string path = levelPath(dataset.path, static_cast<int>(level));
        known.insert(path);
        const auto found = structure.datasets.find(path);
        if (found != structure.datasets.end()) {
          checkDataset(found->second, path, dataset, structure.attributes, use, findings);
        } else if ((dataset.required || !dataset.needs.empty()) && dataset.since <= minorOf(structure.attributes)) {
          findings.add("dataset.missing", "/" + path, "is missing");
        }
      }
    }
    place = end - 1;
  }
  std::set<std::string> groups;
  for (const std::string& path : known) addGroups(path, groups);
  for (const auto& [path, attributes] : structure.groups) {
    if (!groups.contains(path)) findings.add("group.unknown", "/" + path, "is not in the schema");
    warnOfUnknown(attributes, "/" + path, {}, {}, findings);
  }
  for (const auto& [path, record] : structure.datasets) {
    if (!known.contains(path)) findings.add("dataset.unknown", "/" + path, "is not in the schema");
  }
}

}  // namespace glint::formats
