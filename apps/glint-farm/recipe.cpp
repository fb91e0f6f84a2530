#include "glint-farm/recipe.h"

#include <fmt/format.h>

#include <CLI/StringTools.hpp>
#include <algorithm>
#include <functional>
#include <iterator>
#include <string_view>

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
    {"displaced", ".displaced", "heights", {"glint-displace"}, {"--factor", "16"}},
};

[[noreturn]] void refuse(const std::string& what, const std::string& remedy) {
  throw Error(ErrorCode::usage, "farm.make", "", "--make", what, remedy);
}

std::size_t kindOf(std::string_view name) {
  std::vector<std::string> names;
  for (std::size_t k = 0; k < std::size(kKinds); ++k) {
    if (name == kKinds[k].name) return k;
    names.emplace_back(kKinds[k].name);
  }
  const std::string near = nearestName(std::string(name), names);
  refuse("there is no kind \"" + std::string(name) + "\"",
         (near.empty() ? "" : "did you mean " + near + "? ") + std::string("the kinds are ") + recipeKindNames());
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
    if (words.empty()) refuse("the name of a kind is missing", "the kinds are " + recipeKindNames());
    Wanted& kind = kinds[kindOf(words.front())];
    if (kind.given) refuse("two of them are for " + words.front(), "write all flags of " + words.front() + " in one --make");
    kind = {true, true, {words.begin() + 1, words.end()}};
  }
  // Backwards, because sources of sources are wanted too.
  for (std::size_t k = std::size(kKinds); k-- > 0;)
    if (kinds[k].wanted && *kKinds[k].source != '\0') kinds[kindOf(kKinds[k].source)].wanted = true;
  std::vector<RecipeStep> steps;
  for (std::size_t k = 0; k < std::size(kKinds); ++k) {
    if (!kinds[k].wanted) continue;
    if (kinds[k].flags.empty()) kinds[k].flags.assign(kKinds[k].default_flags.begin(), kKinds[k].default_flags.end());
    steps.push_back({&kKinds[k], std::move(kinds[k].flags)});
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
