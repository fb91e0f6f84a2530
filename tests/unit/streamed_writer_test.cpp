#include "glint/formats/streamed_writer.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>

#include "glint/formats/asset_reader.h"
#include "support/sample_assets.h"
#include "support/temp_folder.h"

namespace glint::streamed_writer_test {
namespace {

std::string bytesOf(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

/// A source of some bytes, in pieces of an odd size.
formats::ByteSource inPieces(std::span<const std::byte> bytes) {
  return [bytes](const formats::ByteSink& sink) {
    constexpr std::size_t kPiece = 1001;
    for (std::size_t k = 0; k < bytes.size(); k += kPiece) sink(bytes.subspan(k, std::min(kPiece, bytes.size() - k)));
  };
}

class StreamedWriter : public ::testing::Test {
 protected:
  const test::SampleNormals sample_ = test::sampleNormals(64, 48);
  const test::TempFolder folder_;
};

TEST_F(StreamedWriter, WritesTheSameFile) {
  NormalMap streamed = sample_.map;
  streamed.normals = formats::spanOfSize<Vec2>(sample_.map.normals.size());
  formats::writeStreamedAsset(folder_ / "a.glint", streamed, test::sampleProvenance(),
                              {{"/normals", inPieces(std::as_bytes(sample_.map.normals))}});
  formats::writeAsset(folder_ / "b.glint", sample_.map, test::sampleProvenance());
  EXPECT_EQ(bytesOf(folder_ / "a.glint"), bytesOf(folder_ / "b.glint"));
}

TEST_F(StreamedWriter, RefusesSourcesOfAnotherSize) {
  NormalMap streamed = sample_.map;
  streamed.normals = formats::spanOfSize<Vec2>(sample_.map.normals.size());
  const auto bytes = std::as_bytes(sample_.map.normals);
  for (const auto& given : {bytes.first(bytes.size() - 8), bytes.first(0)}) {
    EXPECT_THROW(
        formats::writeStreamedAsset(folder_ / "a.glint", streamed, test::sampleProvenance(), {{"/normals", inPieces(given)}}),
        Error);
    EXPECT_FALSE(std::filesystem::exists(folder_ / "a.glint"));
  }
  const formats::ByteSource twice = [&](const formats::ByteSink& sink) { sink(bytes), sink(bytes); };
  EXPECT_THROW(formats::writeStreamedAsset(folder_ / "a.glint", streamed, test::sampleProvenance(), {{"/normals", twice}}),
               Error);
}

TEST_F(StreamedWriter, HashesInPiecesFindDamage) {
  formats::writeAsset(folder_ / "a.glint", sample_.map, test::sampleProvenance());
  const formats::OpenOptions options = {.verify_hashes = true, .hash_in_pieces = true};
  std::uint64_t offset = 0;
  {
    const formats::Asset asset = formats::Asset::open(folder_ / "a.glint", options);
    for (const formats::DatasetInfo& dataset : asset.info().datasets)
      if (dataset.path == "/normals") offset = dataset.offset;
  }
  std::string bytes = bytesOf(folder_ / "a.glint");
  bytes[offset] = static_cast<char>(bytes[offset] ^ 1);
  std::ofstream(folder_ / "a.glint", std::ios::binary) << bytes;
  try {
    formats::Asset::open(folder_ / "a.glint", options);
    FAIL() << "damage was not found";
  } catch (const Error& error) {
    EXPECT_EQ(error.rule(), "dataset.hash");
  }
}

}  // namespace
}  // namespace glint::streamed_writer_test
