#include "glint-ingest/ingest_memory.h"

#include <filesystem>

#include "glint/formats/atomic_file.h"

namespace glint::apps {
namespace {

std::uint64_t mostBytes(const Tool& tool) {
  constexpr double kLeastBytes = 16 << 20;  // rows that are being read, and small arrays
  tool.requireMemory(kLeastBytes, "any image", "leave --max-memory out");
  return tool.limitsMemory() ? tool.maxMemory() : tool.maxMemory() / 2;
}

/// The folder of the output, where there must be room for the output too; of a pipe the folder for temporary files.
std::string folderFor(const std::string& output) {
  const formats::OutputTarget target = formats::findOutput(output);
  if (target.kind == formats::OutputTarget::Kind::stream) return std::filesystem::temp_directory_path().string();
  const std::filesystem::path folder = target.path.parent_path();
  return folder.empty() ? "." : folder.string();
}

}  // namespace

IngestMemory::IngestMemory(const Tool& tool, const std::string& output)
    : memory_(mostBytes(tool), folderFor(output)), default_(memory_) {}

}  // namespace glint::apps
