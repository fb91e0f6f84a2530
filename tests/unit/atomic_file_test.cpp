#include "glint/formats/atomic_file.h"

#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <fstream>
#include <string>

#include "glint/model/error.h"
#include "support/temp_folder.h"

namespace glint::formats::atomic_file_test {
namespace {

namespace fs = std::filesystem;
using test::TempFolder;
using ::testing::HasSubstr;

void writeText(const fs::path& path, const std::string& text) { writeFile(path, std::as_bytes(std::span(text))); }

std::string readText(const fs::path& path) {
  std::ifstream file(path);
  return {std::istreambuf_iterator<char>(file), {}};
}

int fileCount(const fs::path& folder) { return static_cast<int>(std::distance(fs::directory_iterator(folder), {})); }

/// What an error of findOutput says; empty if there was none.
std::string refusal(const fs::path& name) {
  try {
    findOutput(name);
    return {};
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::io);
    EXPECT_THAT(error.what(), HasSubstr(name.filename().string()));
    return error.what();
  }
}

TEST(AtomicFile, AppearsWholeWhenItIsPublished) {
  const TempFolder folder;
  {
    AtomicFile file(folder / "a");
    file.write("second", 6, 8);
    file.write("first", 5, 0);
    EXPECT_FALSE(fs::exists(folder / "a"));
    file.publish(false);
  }
  EXPECT_EQ(readText(folder / "a"), std::string("first\0\0\0second", 14));
  EXPECT_EQ(fileCount(folder.path()), 1);
}

TEST(AtomicFile, LeavesTheOldFileUnlessItIsPublished) {
  const TempFolder folder;
  writeText(folder / "a", "old");
  {
    AtomicFile file(folder / "a");
    file.write("new", 3, 0);
  }
  EXPECT_EQ(readText(folder / "a"), "old");
  EXPECT_EQ(fileCount(folder.path()), 1);
}

TEST(AtomicFile, DoesNotReplaceAFileUnlessAsked) {
  const TempFolder folder;
  AtomicFile file(folder / "a");
  writeText(folder / "a", "of another process");
  EXPECT_THROW(file.publish(false), Error);
  EXPECT_EQ(readText(folder / "a"), "of another process");
}

TEST(AtomicFile, IsReadByNobodyElseWhenItReplacesAPrivateFile) {
  const TempFolder folder;
  writeText(folder / "a", "old");
  ASSERT_EQ(::chmod((folder / "a").c_str(), 0600), 0);
  AtomicFile file(folder / "a");
  struct stat status {};
  ASSERT_EQ(::stat(file.path().c_str(), &status), 0);
  EXPECT_EQ(status.st_mode & 0777, 0600u);
}

TEST(AtomicFile, IsLockedByNothingThatFlockMeets) {
  const TempFolder folder;
  const AtomicFile file(folder / "a");
  const int other = ::open(file.path().c_str(), O_RDWR);
  ASSERT_GE(other, 0);
  EXPECT_EQ(::flock(other, LOCK_EX | LOCK_NB), 0) << "HDF5 locks by flock";
  ::close(other);
}

TEST(AtomicFile, LivesBesideAnotherWriterOfTheSameFile) {
  const TempFolder folder;
  AtomicFile first(folder / "a");
  first.write("first", 5, 0);
  {
    AtomicFile second(folder / "a");
    second.write("second", 6, 0);
    second.publish(true);
  }
  ASSERT_TRUE(fs::exists(first.path()));
  first.publish(true);
  EXPECT_EQ(readText(folder / "a"), "first");
}

TEST(AtomicFile, IsRemovedWithAllOthersWhenTheProcessIsToEnd) {
  const TempFolder folder;
  const pid_t child = ::fork();
  if (child == 0) {
    const AtomicFile first(folder / "a");
    const AtomicFile second(folder / "b");
    writeText(folder / "c", "finished");
    removeTemporaryFiles();
    ::_exit(0);
  }
  ::waitpid(child, nullptr, 0);
  EXPECT_EQ(fileCount(folder.path()), 1);
  EXPECT_EQ(readText(folder / "c"), "finished");
}

TEST(AtomicFile, OfAParentStaysWhenAChildEnds) {
  const TempFolder folder;
  const AtomicFile file(folder / "a");
  const pid_t child = ::fork();
  if (child == 0) {
    removeTemporaryFiles();
    ::_exit(0);
  }
  ::waitpid(child, nullptr, 0);
  EXPECT_TRUE(fs::exists(file.path()));
}

TEST(OutputTarget, IsBehindTheLinks) {
  const TempFolder folder;
  fs::create_directory(folder / "store");
  fs::create_symlink("store/b", folder / "a");
  fs::create_symlink("c", folder / "store/b");
  EXPECT_EQ(findOutput(folder / "a").kind, OutputTarget::Kind::missing);
  EXPECT_EQ(findOutput(folder / "a").path, folder / "store/c");
  writeText(folder / "a", "text");
  EXPECT_EQ(findOutput(folder / "a").kind, OutputTarget::Kind::file);
  EXPECT_EQ(readText(folder / "store/c"), "text");
}

TEST(OutputTarget, KnowsDevicesPipesAndDescriptors) {
  const TempFolder folder;
  ASSERT_EQ(::mkfifo((folder / "pipe").c_str(), 0600), 0);
  fs::create_symlink("pipe", folder / "link");
  for (const fs::path& path : {fs::path("/dev/null"), folder / "pipe", folder / "link"}) {
    EXPECT_EQ(findOutput(path).kind, OutputTarget::Kind::stream) << path;
    EXPECT_EQ(findOutput(path).descriptor, -1) << path;
  }
  const int file = ::open((folder / "file").c_str(), O_RDWR | O_CREAT | O_APPEND, 0600);
  const fs::path name = "/dev/fd/" + std::to_string(file);
  EXPECT_EQ(findOutput(name).kind, OutputTarget::Kind::stream);
  EXPECT_EQ(findOutput(name).descriptor, file);
  writeText(name, "one ");
  writeText(name, "two");
  EXPECT_EQ(readText(folder / "file"), "one two");
  ::close(file);
}

TEST(OutputTarget, SaysWhyANameCannotBeWritten) {
  const TempFolder folder;
  fs::create_symlink("x", folder / "y");
  fs::create_symlink("y", folder / "x");
  EXPECT_THAT(refusal(folder / "x"), HasSubstr("symbolic links"));
  EXPECT_THAT(refusal(folder / std::string(300, 'n')), HasSubstr("too long"));
  fs::create_directory(folder / "folder");
  EXPECT_THAT(refusal(folder / "folder"), HasSubstr("is a folder"));
}

TEST(OutputTarget, HasRoomForTheLongestName) {
  const TempFolder folder;
  const std::string name(255, 'n');
  writeText(folder / name, "text");
  EXPECT_EQ(readText(folder / name), "text");
  // What a killed writer of it has left goes as well.
  std::string left;
  {
    const AtomicFile file(folder / name);
    left = file.path().filename();
  }
  std::ofstream(folder / left) << "left";
  writeText(folder / name, "more");
  EXPECT_EQ(fileCount(folder.path()), 1);
}

}  // namespace
}  // namespace glint::formats::atomic_file_test
