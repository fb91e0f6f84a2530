#include "glint-info/summary.h"

#include <algorithm>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "glint-info/statistics.h"
#include "glint/model/json_depth.h"

namespace glint::apps {
namespace {

using nlohmann::ordered_json;

/// Value number k of an attribute, all digits of its type.
ordered_json valueOf(const formats::AttributeInfo& attribute, std::size_t k) {
  if (attribute.type == "text") return attribute.texts[k];
  if (attribute.type == "i32") return static_cast<int>(attribute.numbers[k]);
  return attribute.numbers[k];
}

/// Attributes by name. A covariance is an object of its three elements. Attributes with a value for each level are a table of
/// levels, under their names without "level_".
ordered_json propertiesOf(const formats::AssetInfo& info) {
  ordered_json properties = ordered_json::object(), levels = ordered_json::array();
  for (const formats::AttributeInfo& attribute : info.attributes) {
    const std::size_t count = attribute.type == "text" ? attribute.texts.size() : attribute.numbers.size();
    if (attribute.scalar) {
      properties[attribute.name] = valueOf(attribute, 0);
    } else if (attribute.of_levels) {
      const std::string column = attribute.name.substr(std::string("level_").size());
      for (std::size_t k = 0; k < count; ++k) levels[k][column] = valueOf(attribute, k);
    } else if (attribute.name.ends_with("_covariance")) {
      properties[attribute.name] = {
          {"xx", valueOf(attribute, 0)}, {"xy", valueOf(attribute, 1)}, {"yy", valueOf(attribute, 2)}};
    } else {
      for (std::size_t k = 0; k < count; ++k) properties[attribute.name].push_back(valueOf(attribute, k));
    }
  }
  if (!levels.empty()) properties["levels"] = std::move(levels);
  return properties;
}

std::string listed(const ordered_json& dims) {
  std::string text;
  for (const auto& n : dims) text += (text.empty() ? "" : " x ") + n.dump();
  return text;
}

/// A number with the digits that people read, a text without quotes, or a list or an object of such.
std::string plain(const ordered_json& value) {
  if (value.is_string()) return value.get<std::string>();
  if (value.is_number_float()) {
    char digits[32];
    std::snprintf(digits, sizeof digits, "%.5g", value.get<double>());
    return digits;
  }
  std::string text;
  if (value.is_object()) {
    for (const auto& [key, element] : value.items()) text += (text.empty() ? "" : ", ") + key + " " + plain(element);
    return text;
  }
  if (!value.is_array()) return value.dump();
  for (const auto& element : value) text += (text.empty() ? "" : ", ") + plain(element);
  return text;
}

std::string row(const std::string& name, const std::string& value) {
  return "  " + name + std::string(name.size() < 22 ? 22 - name.size() : 1, ' ') + value + "\n";
}

/// Rows of objects with the same keys, in columns under their names.
std::string table(const ordered_json& rows) {
  std::vector<std::vector<std::string>> cells(1);
  for (const auto& [key, value] : rows.at(0).items()) cells[0].push_back(key);
  for (const auto& entry : rows) {
    cells.emplace_back();
    for (const auto& [key, value] : entry.items()) cells.back().push_back(key == "dims" ? listed(value) : plain(value));
  }
  std::vector<std::size_t> widths(cells[0].size());
  for (const auto& line : cells) {
    for (std::size_t c = 0; c < widths.size(); ++c) widths[c] = std::max(widths[c], line[c].size());
  }
  std::string text;
  for (const auto& line : cells) {
    text += " ";
    for (std::size_t c = 0; c < widths.size(); ++c)
      text += " " + line[c] + std::string(c + 1 < widths.size() ? widths[c] - line[c].size() + 1 : 0, ' ');
    text += "\n";
  }
  return text;
}

std::string section(const char* title, const ordered_json& values) {
  std::string text = std::string(title) + "\n";
  std::string tables;
  for (const auto& [key, value] : values.items()) {
    if (value.is_array() && !value.empty() && value[0].is_object()) {
      tables += key + "\n" + table(value);
    } else {
      text += row(key, plain(value));
    }
  }
  return text + tables;
}

}  // namespace

ordered_json summarize(const formats::Asset& asset) {
  const formats::AssetInfo& info = asset.info();
  ordered_json inputs = ordered_json::array();
  for (const formats::InputRecord& input : info.provenance.inputs)
    inputs.push_back({{"name", input.name}, {"hash", input.hash_hex}});
  ordered_json datasets = ordered_json::array();
  for (const formats::DatasetInfo& dataset : info.datasets) {
    datasets.push_back({{"path", dataset.path},
                        {"type", dataset.type},
                        {"dims", dataset.dims},
                        {"bytes", dataset.size_bytes},
                        {"offset", dataset.offset},
                        {"hash", dataset.hash_hex},
                        {"units", dataset.units},
                        {"long_name", dataset.long_name}});
  }
  // The command is JSON, but the file may hold anything: then it is shown as text.
  const std::string& text = info.provenance.command_json;
  ordered_json command = jsonDepth(text) > kMostJsonDepth ? ordered_json(text) : ordered_json::parse(text, nullptr, false);
  if (command.is_discarded()) command = text;
  ordered_json summary = {
      {"schema_version", kSummarySchemaVersion},
      {"kind", asset.kind()},
      {"format_version", std::to_string(info.format_major) + "." + std::to_string(info.format_minor)},
      {"file_bytes", info.file_bytes},
      {"provenance",
       {{"generator", info.provenance.generator}, {"command", std::move(command)}, {"inputs", std::move(inputs)}}},
      {"properties", propertiesOf(info)},
      {"statistics", statisticsOf(asset)},
      {"datasets", std::move(datasets)}};
  if (info.udim) summary["udim"] = {{"tile", info.udim->tile}, {"margins_texels", info.udim->margins}};
  return summary;
}

std::string summaryText(const std::string& path, const ordered_json& summary) {
  std::string text = path + "\n";
  text += row("kind", plain(summary["kind"])) + row("format_version", plain(summary["format_version"])) +
          row("file_bytes", plain(summary["file_bytes"]));
  if (summary.contains("udim"))
    text += row("udim", plain(summary["udim"]["tile"])) + row("udim margins", plain(summary["udim"]["margins_texels"]));
  text += section("properties", summary["properties"]) + section("statistics", summary["statistics"]);
  const ordered_json& provenance = summary["provenance"];
  text += "provenance\n" + row("generator", plain(provenance["generator"])) + row("command", provenance["command"].dump());
  for (const auto& input : provenance["inputs"]) text += row("input", plain(input["hash"]) + "  " + plain(input["name"]));
  ordered_json parts = ordered_json::array();
  for (const auto& dataset : summary["datasets"]) {
    parts.push_back({{"path", dataset["path"]},
                     {"type", dataset["type"]},
                     {"dims", dataset["dims"]},
                     {"bytes", dataset["bytes"]},
                     {"long_name", dataset["long_name"]}});
  }
  return parts.empty() ? text : text + "datasets\n" + table(parts);
}

}  // namespace glint::apps
