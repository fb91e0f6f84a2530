#include "common/filed_memory.h"

#include <linux/magic.h>
#include <sys/vfs.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>

#include "glint/formats/atomic_file.h"

namespace glint::apps {
namespace {

std::uint64_t mostBytes(const Tool& tool, double least_bytes, const std::string& what) {
  tool.requireMemory(least_bytes, what, "leave --max-memory out");
  return tool.limitsMemory() ? tool.maxMemory() : tool.maxMemory() / 2;
}

bool isInMemory(const std::string& folder) {
  struct statfs disk {};
  return ::statfs(folder.c_str(), &disk) == 0 && (disk.f_type == TMPFS_MAGIC || disk.f_type == RAMFS_MAGIC);
}

/// The folder of the output, where there must be room for the output too. Where there is none, or it is in memory, the folder
/// of TMPDIR, by default /var/tmp, which other than /tmp is on a disk.
std::string folderFor(const std::string& output) {
  const formats::OutputTarget target = formats::findOutput(output);
  const bool stream = target.kind == formats::OutputTarget::Kind::stream;
  const std::filesystem::path parent = target.path.parent_path();
  const std::string folder = parent.empty() ? "." : parent.string();
  if (!stream && !isInMemory(folder)) return folder;
  if (const char* named = std::getenv("TMPDIR"); named != nullptr && *named != '\0') return named;
  const std::string usual = "/var/tmp";
  if (stream || ::access(usual.c_str(), W_OK | X_OK) == 0) return usual;
  return folder;
}

}  // namespace

FiledMemory::FiledMemory(const Tool& tool, const std::string& output, double least_bytes, const std::string& what)
    : folder_(folderFor(output)), memory_(mostBytes(tool, least_bytes, what), folder_), default_(memory_) {
  memory_.watchMappedFiles();
}

void FiledMemory::warnAbout(Tool& tool) const {
  if (memory_.filedBytes() == 0 || !isInMemory(folder_)) return;
  tool.warn(folder_ +
            ": temporary files of this run were in memory (tmpfs), beyond --max-memory; set TMPDIR to a folder on a disk");
}

}  // namespace glint::apps
