#include "glint/formats/udim.h"

#include <algorithm>
#include <string_view>
#include <system_error>

#include "glint/model/error.h"

namespace glint::formats {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kTokens[] = {"<UDIM>", "<udim>", "%(UDIM)d"};
constexpr int kDigits = 4;

/// Where a token begins in a text, and its length; npos where there is none.
struct FoundToken {
  std::size_t begin = std::string::npos;
  std::size_t size = 0;
};

FoundToken findToken(std::string_view text, std::size_t from = 0) {
  FoundToken first;
  for (const std::string_view token : kTokens)
    if (const std::size_t begin = text.find(token, from); begin < first.begin) first = {begin, token.size()};
  return first;
}

[[noreturn]] void refuse(const fs::path& pattern, const std::string& what, const std::string& remedy) {
  throw Error(ErrorCode::usage, "udim.pattern", pattern.string(), "", what, remedy);
}

/// The digits that a name of a file has between two texts; empty if something else is there.
std::string_view numberIn(std::string_view name, std::string_view before, std::string_view after) {
  if (name.size() <= before.size() + after.size() || !name.starts_with(before) || !name.ends_with(after)) return {};
  const std::string_view number = name.substr(before.size(), name.size() - before.size() - after.size());
  const auto is_digit = [](char c) { return c >= '0' && c <= '9'; };
  return std::all_of(number.begin(), number.end(), is_digit) ? number : std::string_view();
}

/// The number of a tile; 0 for other numbers.
int tileOf(std::string_view number) {
  if (number.size() != kDigits) return 0;
  int tile = 0;
  for (const char c : number) tile = 10 * tile + (c - '0');
  return tile >= kFirstUdim ? tile : 0;
}

/// Calls visit(name, number) for each file of the folder that has a number in the place of the token.
template <class Visit>
void forEachNumbered(const fs::path& pattern, const Visit& visit) {
  checkUdimPattern(pattern);
  const std::string name = pattern.filename().string();
  const FoundToken token = findToken(name);
  const std::string before = name.substr(0, token.begin), after = name.substr(token.begin + token.size);
  const fs::path folder = pattern.parent_path().empty() ? fs::path(".") : pattern.parent_path();
  std::error_code fault;
  for (fs::directory_iterator entry(folder, fault), end; !fault && entry != end; entry.increment(fault)) {
    const std::string file = entry->path().filename().string();
    if (const std::string_view number = numberIn(file, before, after); !number.empty()) visit(file, number);
  }
  if (fault)
    throw Error(ErrorCode::io, "udim.files", pattern.string(), "", "the folder cannot be read: " + fault.message(),
                "check the name of the folder and its permissions");
}

}  // namespace

bool isUdimPattern(const fs::path& path) { return findToken(path.native()).begin != std::string::npos; }

void checkUdimPattern(const fs::path& pattern) {
  const std::string name = pattern.filename().string();
  const FoundToken token = findToken(name);
  if (token.begin == std::string::npos || isUdimPattern(pattern.parent_path()))
    refuse(pattern, "names a set of tiles by a folder",
           "put <UDIM> into the name of the file only, such as folder/name.<UDIM>.exr");
  if (findToken(name, token.begin + token.size).begin != std::string::npos)
    refuse(pattern, "has more than one token for the tile", "give one <UDIM>, such as name.<UDIM>.exr");
}

fs::path udimFile(const fs::path& pattern, int tile) {
  std::string text = pattern.native();
  const FoundToken token = findToken(text);
  if (token.begin != std::string::npos) text.replace(token.begin, token.size, std::to_string(tile));
  return text;
}

std::vector<int> udimTiles(const fs::path& pattern) {
  std::vector<int> tiles;
  forEachNumbered(pattern, [&](const std::string&, std::string_view number) {
    if (const int tile = tileOf(number); tile > 0) tiles.push_back(tile);
  });
  if (tiles.empty())
    throw Error(ErrorCode::io, "udim.files", pattern.string(), "", "there is no file of a tile",
                "the files of a set have the number of a tile, 1001 to 9999, in the place of the token, such as " +
                    udimFile(pattern, kFirstUdim).string());
  std::sort(tiles.begin(), tiles.end());
  return tiles;
}

std::vector<std::string> udimStrays(const fs::path& pattern) {
  std::vector<std::string> strays;
  forEachNumbered(pattern, [&](const std::string& file, std::string_view number) {
    if (tileOf(number) == 0) strays.push_back(file);
  });
  std::sort(strays.begin(), strays.end());
  return strays;
}

}  // namespace glint::formats
