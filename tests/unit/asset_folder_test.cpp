#include "measure/asset_folder.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <optional>
#include <string>

#include "glint/formats/descriptor.h"
#include "support/temp_folder.h"

namespace glint::apps::asset_folder_test {
namespace {

namespace fs = std::filesystem;

constexpr const char* kHash = "0123456789abcdef0123456789abcdef";

/// What a process that was killed leaves: a folder with an asset, and a file that nobody locks.
fs::path leave(const fs::path& folder, const char* lock = ".glint.lock") {
  fs::create_directory(folder);
  std::ofstream(folder / "01234567-pyramid.glint") << "asset";
  if (lock != nullptr) std::ofstream(folder / lock) << "";
  return folder;
}

class AssetFolderTest : public testing::Test {
 protected:
  std::string base() const { return (folder_ / "plan.json").string(); }
  test::TempFolder folder_;
};

TEST_F(AssetFolderTest, IsNewAndGoesWithItsScope) {
  fs::path path;
  {
    const AssetFolder first = AssetFolder::temporary(base());
    path = first.path();
    std::ofstream(first.fileOf(kHash, "tucker, tolerance 0.1")) << "asset";
    const AssetFolder second = AssetFolder::temporary(base());
    EXPECT_NE(first.path(), second.path()) << "two of one process, as of processes with one number in two containers";
    EXPECT_TRUE(fs::exists(first.fileOf(kHash, "tucker, tolerance 0.1"))) << "the second leaves the first alone";
  }
  EXPECT_FALSE(fs::exists(path));
  EXPECT_TRUE(fs::is_empty(folder_.path()));
}

TEST_F(AssetFolderTest, RemovesWhatDeadProcessesOfItsBaseLeft) {
  const fs::path left = leave(folder_ / "plan.json.assets-17"), again = leave(folder_ / "plan.json.assets-17-1");
  fs::create_directory(folder_ / "plan.json.assets-18");
  const fs::path other_base = leave(folder_ / "other.json.assets-17"), no_number = leave(folder_ / "plan.json.assets-mine");
  const AssetFolder folder = AssetFolder::temporary(base());
  EXPECT_FALSE(fs::exists(left));
  EXPECT_FALSE(fs::exists(again));
  EXPECT_FALSE(fs::exists(folder_ / "plan.json.assets-18")) << "a process was killed before it made the file";
  EXPECT_TRUE(fs::exists(other_base / "01234567-pyramid.glint"));
  EXPECT_TRUE(fs::exists(no_number / "01234567-pyramid.glint"));
}

TEST_F(AssetFolderTest, KeepsWhatIsLockedUntilTheLastProcessHasEnded) {
  const fs::path killed = folder_ / "plan.json.assets-17";
  std::optional<formats::Descriptor> of_child;
  {
    const AssetFolder made = AssetFolder::temporary(base());
    of_child.emplace(::dup(made.lock()));
    fs::rename(made.path(), killed);  // so that the end of the scope is that of a process that was killed
  }
  std::ofstream(killed / "01234567-map.glint") << "asset";
  { const AssetFolder next = AssetFolder::temporary(base()); }
  EXPECT_TRUE(fs::exists(killed / "01234567-map.glint")) << "a program that it started works on";
  of_child.reset();
  { const AssetFolder next = AssetFolder::temporary(base()); }
  EXPECT_FALSE(fs::exists(killed));
}

TEST_F(AssetFolderTest, KeepsWhatMayBeOfOthers) {
  const fs::path without = leave(folder_ / "plan.json.assets-17", nullptr), with_notes = leave(folder_ / "plan.json.assets-18");
  std::ofstream(with_notes / "notes.txt") << "mine";
  const fs::path elsewhere = leave(folder_ / "elsewhere");
  fs::create_directory_symlink(elsewhere, folder_ / "plan.json.assets-19");
  { const AssetFolder next = AssetFolder::temporary(base()); }
  EXPECT_TRUE(fs::exists(without / "01234567-pyramid.glint"));
  EXPECT_TRUE(fs::exists(with_notes / "notes.txt"));
  EXPECT_TRUE(fs::exists(elsewhere / "01234567-pyramid.glint")) << "a link is not followed";
}

}  // namespace
}  // namespace glint::apps::asset_folder_test
