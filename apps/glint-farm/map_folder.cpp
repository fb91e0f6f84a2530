#include "glint-farm/map_folder.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <map>
#include <system_error>

#include "common/files.h"
#include "glint/model/error.h"

namespace glint::apps {
namespace {

namespace fs = std::filesystem;

bool isImage(const fs::path& file) {
  std::string type = file.extension().string();
  if (type.empty()) return false;
  for (char& c : type) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return std::find(imageTypes().begin(), imageTypes().end(), type.substr(1)) != imageTypes().end();
}

/// The name of a file in a folder. It is never one that programs take for an option.
std::string join(const std::string& folder, const std::string& file) {
  const std::string name = (fs::path(folder) / file).lexically_normal().string();
  return name.starts_with('-') ? "./" + name : name;
}

/// Puts the name of the image, without ending, in place of the first %, as pattern rules of Make do.
std::string withStem(const std::string& word, const std::string& stem) {
  const std::size_t place = word.find('%');
  return place == std::string::npos ? word : word.substr(0, place) + stem + word.substr(place + 1);
}

/// Adds the flags of a step. Files that flags name are inputs, and words of their own.
void addFlags(FarmJob& job, const RecipeStep& step, const std::string& stem, const std::string& here) {
  for (const RecipeFlag& flag : step.flags) {
    std::string word = withStem(flag.word, stem);
    if (flag.names_file) {
      checkRegular(word);
      if (!fs::path(word).is_absolute()) word = join(here, word);
      job.inputs.push_back(word);
    }
    job.command.push_back(std::move(word));
  }
}

/// Adds jobs that make a pyramid in parts, and one that joins them. The parts are named as glint.mk names them.
/// @param whole  the job of one run: "NAME.pyramid.glint"
void addShards(std::vector<FarmJob>& jobs, const FarmJob& whole, int count) {
  const std::string ending = ".glint", stem = whole.output.substr(0, whole.output.size() - ending.size());
  FarmJob join;
  join.output = whole.output;
  join.command = {"glint-merge"};
  for (int index = 1; index <= count; ++index) {
    FarmJob part = whole;
    part.output = fmt::format("{}.{}of{}{}", stem, index, count, ending);
    std::replace(part.command.begin(), part.command.end(), whole.output, part.output);
    part.command.insert(part.command.end(), {"--region", fmt::format("{}/{}", index, count)});
    join.inputs.push_back(part.output);
    join.command.push_back(part.output);
    jobs.push_back(std::move(part));
  }
  join.command.insert(join.command.end(), {"-o", join.output});
  jobs.push_back(std::move(join));
}

void refuseTwins(const std::vector<std::string>& images, const std::string& folder) {
  std::map<std::string, std::string> by_stem;
  for (const std::string& image : images) {
    const auto [twin, is_new] = by_stem.emplace(fs::path(image).replace_extension().string(), image);
    if (is_new) continue;
    throw Error(ErrorCode::usage, "farm.twins", join(folder, image), "", "and " + twin->second + " would be assets of one name",
                "rename one of the images, or move it to another folder");
  }
}

}  // namespace

std::vector<std::string> imagesIn(const std::string& folder, const std::string& assets) {
  std::vector<std::string> images;
  std::error_code error;
  fs::recursive_directory_iterator entry(folder, error);
  for (; !error && entry != fs::recursive_directory_iterator(); entry.increment(error)) {
    const fs::path& path = entry->path();
    std::error_code none;
    const bool hidden = path.filename().string().starts_with('.');
    if (entry->is_directory(none)) {
      if (hidden || fs::equivalent(path, assets, none)) entry.disable_recursion_pending();
    } else if (!hidden && isImage(path) && entry->is_regular_file(none)) {
      images.push_back(path.lexically_relative(folder).string());
    }
  }
  if (error) throw Error(ErrorCode::io, "file.readable", folder, "", error.message(), "name a folder of images");
  if (images.empty()) {
    throw Error(ErrorCode::io, "farm.empty", folder, "", "holds no image",
                "name a folder of images (exr, png, tif, tga, jpg, hdr), or give a plan with --from");
  }
  std::sort(images.begin(), images.end());
  refuseTwins(images, folder);
  return images;
}

std::vector<FarmJob> jobsOf(const std::string& image, const std::string& maps, const std::string& assets,
                            const std::string& here, const std::vector<RecipeStep>& recipe, int map_shards) {
  const std::string stem = fs::path(image).replace_extension().string();
  std::map<std::string, std::string> made;  // kind -> file
  std::vector<FarmJob> jobs;
  for (const RecipeStep& step : recipe) {
    const RecipeKind& kind = *step.kind;
    FarmJob job;
    job.output = join(assets, stem + kind.suffix + ".glint");
    job.inputs = {*kind.source == '\0' ? join(maps, image) : made.at(kind.source)};
    job.command = {*kind.command.begin(), job.inputs.front(), "-o", job.output};
    job.command.insert(job.command.end(), kind.command.begin() + 1, kind.command.end());
    addFlags(job, step, stem, here);
    made[kind.name] = job.output;
    if (map_shards > 1 && kind.name == std::string("pyramid"))
      addShards(jobs, job, map_shards);
    else
      jobs.push_back(std::move(job));
  }
  return jobs;
}

}  // namespace glint::apps
