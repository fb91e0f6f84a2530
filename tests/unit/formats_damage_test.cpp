#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstring>
#include <filesystem>
#include <limits>
#include <random>

#include "glint/formats/asset_reader.h"
#include "glint/formats/asset_writer.h"
#include "glint/formats/conformance.h"
#include "glint/formats/container/container.h"
#include "glint/formats/validate.h"
#include "support/hdf5_bytes.h"
#include "support/sample_assets.h"
#include "support/source_folder.h"
#include "support/temp_folder.h"

namespace glint::formats::formats_damage_test {
namespace {

namespace fs = std::filesystem;

std::string golden(const std::string& name) { return test::goldenFolder() / name; }

/// Rule of the error that opening raises; "" if it opens.
std::string ruleOf(const fs::path& path) {
  try {
    Asset::open(path);
    return "";
  } catch (const Error& error) {
    EXPECT_FALSE(error.path().empty());
    return error.rule();
  }
}

/// A golden file with bytes from `at` on replaced and its checksums renewed.
test::Bytes damaged(const std::string& name, std::size_t at, std::initializer_list<int> values) {
  test::Bytes bytes = test::readBytes(golden(name));
  const auto ranges = test::checksummedRanges(bytes);
  for (const int value : values) bytes.at(at++) = static_cast<std::byte>(value);
  test::renewChecksums(bytes, ranges);
  return bytes;
}

TEST(DamagedFiles, EveryFlippedBitIsFound) {
  test::Bytes bytes = test::readBytes(golden("sh-lobes.glint"));
  for (std::size_t k = 0; k < 8 * bytes.size(); ++k) {
    const auto bit = static_cast<std::byte>(1u << k % 8);
    bytes[k / 8] ^= bit;
    EXPECT_FALSE(validateMemory(bytes, "flipped").valid()) << "bit " << k % 8 << " of byte " << k / 8;
    bytes[k / 8] ^= bit;
  }
}

TEST(DamagedFiles, FlippedBitsOfEveryGoldenFileAreFoundByHashesAlone) {
  constexpr int kFlips = 1000;  // of each file; the slow test GoldenFiles.FlippedBitsAreFound has more
  std::mt19937_64 random(3);
  for (const auto& entry : fs::directory_iterator(golden(""))) {
    test::Bytes bytes = test::readBytes(entry.path().string());
    ASSERT_TRUE(validateMemory(bytes, "whole").findings.empty()) << entry.path();
    for (int k = 0; k < kFlips; ++k) {
      const std::size_t bit = random() % (8 * bytes.size());
      bytes[bit / 8] ^= static_cast<std::byte>(1u << bit % 8);
      EXPECT_FALSE(validateMemory(bytes, "flipped", {.data = false}).valid()) << entry.path() << " bit " << bit;
      bytes[bit / 8] ^= static_cast<std::byte>(1u << bit % 8);
    }
  }
}

TEST(DamagedFiles, EveryFlippedByteOfAlignmentIsFound) {
  const test::TempFolder folder;
  const fs::path path = folder / "a.glint";
  for (const char* name : {"ndf-cp-cp-i8.glint", "bin-map.glint", "normals.glint"}) {
    test::Bytes bytes = test::readBytes(golden(name));
    const std::vector<Extent> extents = readContainer(bytes).extents;
    std::uint64_t end = 0;
    std::size_t between = 0;
    for (const Extent& extent : extents) {
      for (; end < extent.begin; ++end, ++between) {
        bytes[end] ^= std::byte{0x10};
        test::writeBytes(path.string(), bytes);
        const ValidationReport report = validateAsset(path);
        ASSERT_EQ(report.findings.size(), 1u) << name << " " << end;
        EXPECT_EQ(report.findings[0].rule, "file.padding");
        bytes[end] ^= std::byte{0x10};
      }
      end = std::max(end, extent.end);
    }
    EXPECT_EQ(end, bytes.size());
    EXPECT_GT(between, 0u);
  }
}

TEST(DamagedFiles, AppendedBytesAreFound) {
  const test::TempFolder folder;
  for (const std::size_t count : {1u, 100u}) {
    test::Bytes bytes = test::readBytes(golden("heights.glint"));
    bytes.resize(bytes.size() + count);
    test::writeBytes((folder / "a.glint").string(), bytes);
    EXPECT_EQ(ruleOf(folder / "a.glint"), "file.trailing");
  }
}

TEST(DamagedFiles, AHeapIsRefusedBeforeAnyoneLooksForIt) {
  const test::TempFolder folder;
  const fs::path path = folder / "a.glint";
  // Byte 114 of this file is the lowest of the address of the root's heap of attributes, which it does not have.
  test::writeBytes(path.string(), damaged("heights.glint", 114, {0xf7}));
  EXPECT_EQ(ruleOf(path), "object.heap");
}

TEST(DamagedFiles, EveryBitOfMetadataMayBeWrongBehindARightChecksum) {
  const test::TempFolder folder;
  const fs::path path = folder / "a.glint";
  // Of the file with more metadata every third bit: each takes a file that is written and opened.
  for (const auto& [name, step] : {std::pair{"sh-lobes.glint", 1u}, std::pair{"heights.glint", 3u}}) {
    const test::Bytes good = test::readBytes(golden(name));
    const auto ranges = test::checksummedRanges(good);
    std::size_t refused = 0, read = 0;
    for (const test::ChecksummedRange& range : ranges) {
      for (std::size_t k = 8 * range.begin; k < 8 * (range.end - 4); k += step) {
        test::Bytes bytes = good;
        bytes[k / 8] ^= static_cast<std::byte>(1u << k % 8);
        test::renewChecksums(bytes, ranges);
        test::writeBytes(path.string(), bytes);
        try {
          Asset::open(path);
          ++read;  // a text or a number that means something else now
        } catch (const Error& error) {
          EXPECT_TRUE(error.code() == ErrorCode::invalid_input || error.code() == ErrorCode::unsupported) << error.what();
          ++refused;
        }
      }
    }
    EXPECT_GT(refused, read);
    EXPECT_GT(read, 0u);
  }
}

TEST(DamagedFiles, TruncatedObjectHeadersAreRefused) {
  const test::Bytes good = test::readBytes(golden("ndf-cp-cp-i8.glint"));
  for (const test::ChecksummedRange& range : test::checksummedRanges(good)) {
    for (std::size_t size = std::max<std::size_t>(range.begin, 48); size < range.end; ++size) {
      test::Bytes bytes(good.begin(), good.begin() + static_cast<std::ptrdiff_t>(size));
      constexpr std::size_t kEndOfFile = 28;  // place of the file's length in the superblock
      std::memcpy(bytes.data() + kEndOfFile, &size, sizeof size);
      test::renewChecksums(bytes, {{0, 48}});
      EXPECT_THROW(readContainer(bytes), Error) << size;
    }
  }
}

TEST(DamagedFiles, BuildersAreToldTheTexelOfABadValue) {
  const test::TempFolder folder;
  const fs::path path = folder / "a.glint";
  const auto sample = test::sampleNormals(32, 24);
  const float infinity = std::numeric_limits<float>::infinity();
  for (const float bad : {std::numeric_limits<float>::quiet_NaN(), infinity, -infinity, 1.5f}) {
    writeAsset(path, sample.map, test::sampleProvenance(), {.overwrite = true});
    test::Bytes bytes = test::readBytes(path.string());
    std::uint64_t offset = 0;
    const Asset asset = Asset::open(path);
    for (const DatasetInfo& dataset : asset.info().datasets)
      if (dataset.path == "/normals") offset = dataset.offset;
    // Column 3 of row 7 from the top; rows are stored from the bottom.
    std::memcpy(bytes.data() + offset + ((24 - 1 - 7) * 32 + 3) * sizeof(Vec2), &bad, sizeof bad);
    test::renewHashes(bytes);
    test::renewChecksums(bytes, test::checksummedRanges(bytes));
    test::writeBytes(path.string(), bytes);
    EXPECT_EQ(ruleOf(path), "");  // values are not checked where queries only need to be safe
    try {
      Asset::openForBuilding(path);
      ADD_FAILURE() << bad;
    } catch (const Error& error) {
      EXPECT_EQ(error.code(), ErrorCode::invalid_input);
      EXPECT_THAT(error.what(), testing::HasSubstr("first at column 3, row 7 from the top")) << bad;
    }
  }
}

TEST(DamagedFiles, BuildersRefuseDataWithAnotherHash) {
  const test::TempFolder folder;
  for (const char* name : {"heights.glint", "ndf-pyramid.glint", "displacement.glint", "histogram-sat.glint", "bin-map.glint",
                           "ndf-cp-cp-i8.glint", "sh-lobes.glint", "sh-light.glint"}) {
    const fs::path path = folder / name;
    test::Bytes bytes = test::readBytes(golden(name));
    Asset::openForBuilding(golden(name));
    // Half of the biggest dataset's last element: another finite number.
    const DatasetInfo* biggest = nullptr;
    const Asset asset = Asset::open(golden(name));
    for (const DatasetInfo& dataset : asset.info().datasets)
      if (biggest == nullptr || dataset.size_bytes > biggest->size_bytes) biggest = &dataset;
    bytes[biggest->offset + biggest->size_bytes - 2] ^= std::byte{1};
    test::writeBytes(path.string(), bytes);
    EXPECT_THROW(Asset::openForBuilding(path), Error) << name;
  }
}

/// An attribute that a later minor version might add to heights.
KindSchema heightsWithNewAttribute() {
  KindSchema schema = *findKindSchema("heights");
  AttributeSchema added = schema.attributes.front();
  added.name = "colour";
  added.since = 1;
  schema.attributes.push_back(added);
  DatasetSchema dataset = schema.datasets.front();
  dataset.path = "colours";
  dataset.since = 1;
  schema.datasets.push_back(dataset);
  return schema;
}

TEST(FormatVersions, OlderFilesNeedNotHaveWhatALaterMinorVersionAdded) {
  const test::TempFolder folder;
  const fs::path path = folder / "a.glint";
  writeAsset(path, test::sampleHeights(16, 16).map, test::sampleProvenance());
  Findings reading(path);
  FileStructure structure = readStructure(FileBytes::ofFile(path, false), reading);
  ASSERT_FALSE(reading.failed());
  const KindSchema schema = heightsWithNewAttribute();
  const auto missing = [&] {
    Findings findings(path);
    checkConformance(structure, schema, findings);
    std::vector<std::string> objects;
    for (const Finding& finding : findings.report().findings) objects.push_back(finding.rule + " " + finding.object);
    return objects;
  };
  EXPECT_THAT(missing(), testing::IsEmpty());  // 1.0
  structure.attributes.at("format_minor").numbers = {1};
  EXPECT_THAT(missing(), testing::ElementsAre("attribute.missing /@colour"));
  structure.attributes["colour"] = structure.attributes.at("width");
  EXPECT_THAT(missing(), testing::ElementsAre("dataset.missing /colours"));
}

}  // namespace
}  // namespace glint::formats::formats_damage_test
