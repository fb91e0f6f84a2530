#pragma once

#include <string>
#include <vector>

#include "glint-farm/manifest_builder.h"

namespace glint::apps {

/// The jobs of a file of glint-plan, a plan or the file of --jobs.
/// @param folder  of the manifest: names of files are those that it sees
/// @throws Error io; invalid_input if the file has no jobs
std::vector<FarmJob> readJobs(const std::string& path, const std::string& folder);

}  // namespace glint::apps
