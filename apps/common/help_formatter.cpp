#include "common/help_formatter.h"

#include <fmt/format.h>

#include <algorithm>
#include <vector>

namespace glint::apps {
namespace {

std::string names(const std::set<CLI::Option*>& options) {
  std::set<std::string> sorted;  // `options` is in the order of addresses
  for (const CLI::Option* option : options) sorted.insert(option->get_name());
  return fmt::format("{}", fmt::join(sorted, ", "));
}

}  // namespace

std::string HelpFormatter::make_option_opts(const CLI::Option* option) const {
  const std::string type = option->get_type_name();  // "FLOAT:0 to 1": the type, and the texts of its checks
  const std::size_t colon = std::min(type.find(':'), type.size());
  std::string text;
  for (int k = 0; k < std::clamp(option->get_expected_min(), 1, 8) && colon > 0; ++k) text += " " + type.substr(0, colon);
  std::vector<std::string> notes;
  if (colon < type.size()) notes.push_back(type.substr(colon + 1));
  if (option->get_required())
    notes.push_back("required");
  else if (!option->get_default_str().empty())
    notes.push_back("default " + option->get_default_str());
  if (!option->get_needs().empty()) notes.push_back("needs " + names(option->get_needs()));
  if (!option->get_excludes().empty()) notes.push_back("not with " + names(option->get_excludes()));
  return notes.empty() ? text : fmt::format("{} ({})", text, fmt::join(notes, ", "));
}

}  // namespace glint::apps
