#include "glint-farm/plan_command.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string_view>

#include "common/input_name.h"
#include "glint-farm/jobs_file.h"
#include "glint-farm/manifest_builder.h"
#include "glint-farm/map_folder.h"
#include "glint/model/ndf_pyramid_shard.h"
#include "manifest/entry_records.h"

namespace glint::apps {
namespace {

namespace fs = std::filesystem;

/// A folder as the folder of the manifest sees it.
std::string seenFrom(const std::string& folder, const std::string& manifest_folder) {
  return fs::proximate(fs::weakly_canonical(fs::absolute(folder)), fs::weakly_canonical(fs::absolute(manifest_folder)))
      .string();
}

[[noreturn]] void refuse(const std::string& object, const std::string& what, const std::string& remedy) {
  throw Error(ErrorCode::usage, "cli.usage", "", object, what, remedy);
}

/// Refuses what --map-shards cannot divide.
void checkShards(const std::vector<RecipeStep>& recipe, int map_shards) {
  if (map_shards == 1) return;
  const auto step = std::find_if(recipe.begin(), recipe.end(),
                                 [](const RecipeStep& s) { return s.kind->name == std::string_view("pyramid"); });
  if (step == recipe.end())
    refuse("--map-shards", "no pyramid is made, and only pyramids are made in parts", "add --make pyramid");
  for (const auto& flag : step->flags) {
    for (const char* whole : {"--region", "--optics"})
      if (flag.word.starts_with(whole))
        refuse("--map-shards", "parts are made by --region, and of normals only", "leave " + std::string(whole) + " out");
  }
}

std::size_t countDone(const Manifest& manifest) {
  const EntryRecords records(manifest);
  return static_cast<std::size_t>(
      std::count_if(manifest.entries.begin(), manifest.entries.end(),
                    [&](const ManifestEntry& entry) { return records.stateOf(entry) == EntryState::done; }));
}

}  // namespace

ToolInfo FarmPlanCommand::info() {
  return {
      "glint-farm plan",
      "Writes down which assets to make of which maps, each once. Maps of the same bytes share their assets.",
      "glint-farm plan textures -o farm.json --make 'normals --convention directx' --make 'pyramid --stride 8' --make cp",
      "Kinds and the flags that they have by default are those of pipelines/glint.mk; a kind that another is made of comes "
      "with it. "
      "In flags, % stands for the name of the map without its ending, as in --make 'displaced --base-color colours/%.png'."};
}

FarmPlanCommand::FarmPlanCommand(Tool& tool)
    : tool_(tool), output_(tool, OutputFormat::manifest, "manifest (.json): docs/json/files/farm-manifest.schema.json") {
  tool.option("FOLDER", folder_, "images, also those in its folders").unrecorded();
  tool.option("--from", from_, "instead of a folder: a plan of glint-plan, or the file of its --jobs")
      .defaultText("none")
      .unrecorded();
  tool.parser()
      .add_option("--make", makes_,
                  "kind of asset to make of every image, and flags for it, as in --make 'pyramid --stride 8'; repeat it for "
                  "more kinds: " +
                      recipeKindNames())
      ->allow_extra_args(false)
      ->type_name("KIND")
      ->default_str("");
  tool.option("--map-shards", map_shards_,
              "make each pyramid of normals in so many parts, which glint-merge joins: for maps whose images are too many for "
              "one run; see "
              "glint-pyramid --region")
      .range(1, kMostRegions);
  tool.option("--assets", assets_, "folder of the assets").defaultText("assets, beside the manifest").unrecorded();
  tool.addCheck([this] { check(); });
}

void FarmPlanCommand::check() {
  if (folder_.empty() == from_.empty())
    refuse("FOLDER", from_.empty() ? "there is nothing to plan" : "a folder and --from exclude each other",
           "give a folder of images, or --from PLAN.json");
  if (!folder_.empty() && makes_.empty())
    refuse("--make", "nothing is to be made of the images",
           "give a kind, such as --make pyramid; the kinds are " + recipeKindNames());
  if (!from_.empty() && !(makes_.empty() && assets_.empty() && map_shards_ == 1))
    refuse("--from", "a plan says what to make, and where", "leave out --make, --assets and --map-shards");
  if (!from_.empty()) {
    checkRegular(from_);
    tool_.addInput(from_);
  }
  checkShards(recipeOf(makes_), map_shards_);
}

void FarmPlanCommand::run() {
  const std::string folder = manifestFolder(output_.path());
  ManifestBuilder builder(tool_, output_.path());
  std::vector<FarmJob> jobs;
  std::vector<std::string> maps;
  if (!from_.empty()) {
    jobs = readJobs(from_, folder);
  } else {
    const std::vector<RecipeStep> recipe = recipeOf(makes_);
    if (assets_.empty()) assets_ = folder + "/assets";
    const std::string there = seenFrom(folder_, folder), assets = seenFrom(assets_, folder), here = seenFrom(".", folder);
    for (const std::string& image : imagesIn(folder_, assets_)) {
      std::vector<FarmJob> of_image = jobsOf(image, there, assets, here, recipe, map_shards_);
      maps.push_back(of_image.front().inputs.front());
      std::move(of_image.begin(), of_image.end(), std::back_inserter(jobs));
    }
  }
  for (const FarmJob& job : jobs)
    for (const std::string& word : job.command) requireText(word, word);  // manifests are UTF-8
  builder.hashMaps(maps, tool_.progress("maps"));
  for (FarmJob& job : jobs) builder.add(std::move(job));
  const Manifest manifest = builder.take();
  writeTextFile(output_.path(), manifestText(manifest));
  const std::size_t done = countDone(manifest);
  tool_.setResult({{"maps", manifest.maps.size()},
                   {"hashed_maps", builder.hashedMaps()},
                   {"entries", manifest.entries.size()},
                   {"duplicates", builder.duplicates()},
                   {"done", done}});
  tool_.summary(fmt::format("{} maps, {} of them read now; {} assets to make, {} of them made already; {} duplicates\n",
                            manifest.maps.size(), builder.hashedMaps(), manifest.entries.size(), done, builder.duplicates()));
}

}  // namespace glint::apps
