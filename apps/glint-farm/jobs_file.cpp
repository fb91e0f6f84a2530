#include "glint-farm/jobs_file.h"

#include <algorithm>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "common/json_file.h"
#include "glint/model/error.h"

namespace glint::apps {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

[[noreturn]] void refuseJobs(const std::string& path, const std::string& what) {
  throw Error(ErrorCode::invalid_input, "farm.jobs", path, "", what,
              "make it with glint-plan SCENE -o FILE, or with glint-plan SCENE --jobs FILE");
}

FarmJob jobOf(const json& value, const std::string& path) {
  FarmJob job{value.at("command").get<std::vector<std::string>>(), value.at("inputs").get<std::vector<std::string>>(), {}};
  const auto outputs = value.at("outputs").get<std::vector<std::string>>();
  if (outputs.size() != 1) refuseJobs(path, "has a job that does not make exactly one file");
  job.output = outputs.front();
  return job;
}

/// Names the files of a job as another folder sees them.
void move(FarmJob& job, const fs::path& from, const fs::path& to) {
  const auto moved = [&](const std::string& file) {
    return fs::path(file).is_absolute() ? file : (from / file).lexically_normal().lexically_relative(to).string();
  };
  std::vector<std::string*> names = {&job.output};
  for (std::string& input : job.inputs) names.push_back(&input);
  for (std::string* name : names) {
    std::string there = moved(*name);
    if (there.starts_with('-')) there.insert(0, "./");  // or programs would take it for an option
    std::replace(job.command.begin(), job.command.end(), *name, there);
    *name = there;
  }
}

}  // namespace

std::vector<FarmJob> readJobs(const std::string& path, const std::string& folder) {
  const json document = readJsonOrNothing(path);
  const auto form = document.is_object() ? document.value("schema", json()) : json();
  if (form != "glint-plan plan 1" && form != "glint-plan jobs 1") refuseJobs(path, "is neither a plan nor jobs of glint-plan");
  if (!document.contains("jobs")) refuseJobs(path, "is a plan without jobs, of an earlier version");
  const fs::path from = fs::weakly_canonical(fs::absolute(manifestFolder(path))),
                 to = fs::weakly_canonical(fs::absolute(folder));
  std::vector<FarmJob> jobs;
  try {
    for (const json& value : document.at("jobs")) {
      jobs.push_back(jobOf(value, path));
      move(jobs.back(), from, to);
    }
  } catch (const json::exception&) {
    refuseJobs(path, "has a job that lacks a part");
  }
  return jobs;
}

}  // namespace glint::apps
