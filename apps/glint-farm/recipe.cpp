#include "glint-farm/recipe.h"

#include <fmt/format.h>

#include <CLI/StringTools.hpp>
#include <algorithm>
#include <cctype>
#include <functional>
#include <iterator>
#include <span>
#include <string_view>

#include "common/numbers.h"
#include "common/suggest.h"
#include "glint/model/error.h"

namespace glint::apps {
namespace {

/// Sources come before what is made of them. Names, suffixes and default flags are those of pipelines/glint.mk.
const RecipeKind kKinds[] = {
    {"normals", "", "", {"glint-ingest"}, {}},
    {"heights", ".heights", "", {"glint-ingest", "--kind", "height", "--to", "heights"}, {}},
    {"pyramid", ".pyramid", "normals", {"glint-pyramid"}, {}},
    {"cp", ".cp", "pyramid", {"glint-compress", "--method", "cp"}, {"--rank", "16"}},
    {"tucker", ".tucker", "pyramid", {"glint-compress", "--method", "tucker"}, {"--rank", "25"}},
    {"pca", ".pca", "pyramid", {"glint-compress", "--method", "pca"}, {"--rank", "16"}},
    {"binmap", ".binmap", "normals", {"glint-binmap"}, {}},
    {"sat", ".sat", "normals", {"glint-sat"}, {}},
    {"moments", ".moments", "normals", {"glint-moments"}, {}},
    {"tiny", ".tiny", "normals", {"glint-tiny"}, {"--cut", "32"}},
    {"wang", ".wang", "normals", {"glint-wang"}, {}},
    {"wave", ".wave", "heights", {"glint-pyramid", "--optics", "wave"}, {}},
    {"wavecp", ".wavecp", "wave", {"glint-compress"}, {"--tolerance", "0.1"}},
    {"displaced", ".displaced", "heights", {"glint-displace"}, {"--factor", "16"}},
};

[[noreturn]] void refuseMake(const std::string& what, const std::string& remedy) {
  throw Error(ErrorCode::usage, "farm.make", "", "--make", what, remedy);
}

std::size_t kindOf(std::string_view name) {
  std::vector<std::string> names;
  for (std::size_t k = 0; k < std::size(kKinds); ++k) {
    if (name == kKinds[k].name) return k;
    names.emplace_back(kKinds[k].name);
  }
  const std::string near = nearestName(std::string(name), names);
  refuseMake("there is no kind \"" + std::string(name) + "\"",
             (near.empty() ? "" : "did you mean " + near + "? ") + std::string("the kinds are ") + recipeKindNames());
}

/// Options of the programs that name files which these read.
constexpr std::string_view kFileOptions[] = {"--base-color", "--base-roughness", "--config", "--roughness", "--transforms"};

/// Options that the farm gives itself, whose files it could not keep track of, or with which programs make no asset.
constexpr std::string_view kRefusedOptions[] = {"--threads",    "--progress", "--json",          "--quiet",  "--verbose",
                                                "--max-memory", "--depfile",  "--textures",      "--output", "--help",
                                                "--version",    "--trust",    "--skip-unchanged"};

bool isOneOf(std::string_view word, std::span<const std::string_view> options) {
  return std::find(options.begin(), options.end(), word) != options.end();
}

/// Refuses an option that --make cannot have. Of those of one letter only -f can, because letters may stand together, as in -qo.
void refuseOption(std::string_view option, const std::string& kind) {
  const bool is_short = option.size() > 1 && option[0] == '-' && std::isalpha(static_cast<unsigned char>(option[1]));
  if (!isOneOf(option, kRefusedOptions) && (!is_short || option == "-f")) return;
  refuseMake("flags of " + kind + " cannot hold " + std::string(option) +
                 ": glint-farm gives it itself, or could not keep track of what it does",
             "leave it out; glint-farm run has --threads, --max-memory and --trust");
}

/// The words of flags, with --option=FILE as two words.
std::vector<RecipeFlag> flagsOf(const std::vector<std::string>& words, const std::string& kind) {
  std::vector<RecipeFlag> flags;
  std::string_view file_option;  // whose file comes next
  const auto addValue = [&](const std::string& value) {
    double number = 0;
    const bool is_number = file_option == "--roughness" && parseNumber(value, number).empty();
    flags.push_back({value, !file_option.empty() && !is_number});
    file_option = {};
  };
  for (const std::string& word : words) {
    const std::size_t end = std::min(word.find('='), word.size());
    const std::string option = word.substr(0, end);
    if (!file_option.empty()) {
      addValue(word);
    } else if (refuseOption(option, kind); isOneOf(option, kFileOptions)) {
      flags.push_back({option, false});
      file_option = *std::find(std::begin(kFileOptions), std::end(kFileOptions), option);
      if (end < word.size()) addValue(word.substr(end + 1));
    } else {
      flags.push_back({word, false});
    }
  }
  if (!file_option.empty())
    refuseMake("the file of " + std::string(file_option) + " is missing", "name it behind " + std::string(file_option));
  return flags;
}

/// A step that is wanted, and the flags that were given for it.
struct Wanted {
  bool wanted = false, given = false;
  std::vector<std::string> flags;
};

}  // namespace

std::vector<RecipeStep> recipeOf(const std::vector<std::string>& asked) {
  Wanted kinds[std::size(kKinds)];
  for (const std::string& text : asked) {
    std::vector<std::string> words = CLI::detail::split_up(text);
    if (words.empty()) refuseMake("the name of a kind is missing", "the kinds are " + recipeKindNames());
    Wanted& kind = kinds[kindOf(words.front())];
    if (kind.given)
      refuseMake("two of them are for " + words.front(), "write all flags of " + words.front() + " in one --make");
    kind = {true, true, {words.begin() + 1, words.end()}};
  }
  // Backwards, because sources of sources are wanted too.
  for (std::size_t k = std::size(kKinds); k-- > 0;)
    if (kinds[k].wanted && *kKinds[k].source != '\0') kinds[kindOf(kKinds[k].source)].wanted = true;
  std::vector<RecipeStep> steps;
  for (std::size_t k = 0; k < std::size(kKinds); ++k) {
    if (!kinds[k].wanted) continue;
    if (kinds[k].flags.empty()) kinds[k].flags.assign(kKinds[k].default_flags.begin(), kKinds[k].default_flags.end());
    steps.push_back({&kKinds[k], flagsOf(kinds[k].flags, kKinds[k].name)});
  }
  return steps;
}

std::string recipeKindNames() {
  std::vector<std::string> names;
  for (const RecipeKind& kind : kKinds) names.emplace_back(kind.name);
  return fmt::format("{}", fmt::join(names, ", "));
}

const std::vector<std::string>& imageTypes() {
  static const std::vector<std::string> types = {"exr", "png", "tif", "tiff", "tga", "jpg", "jpeg", "hdr"};
  return types;
}

}  // namespace glint::apps
