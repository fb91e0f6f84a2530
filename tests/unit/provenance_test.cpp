#include "glint/formats/provenance.h"

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "glint/api/any_ndf.h"
#include "glint/formats/asset_writer.h"
#include "glint/formats/hash.h"
#include "support/sample_assets.h"
#include "support/temp_folder.h"

namespace glint::formats::provenance_test {
namespace {

TEST(Provenance, ChainedInputsNameTheInputTheyBelongTo) {
  const Provenance made = {"tool", "{}", {{"map.glint", "11"}}};
  const Provenance run = chained({"other", "{}", {{"pyramid.glint", "22"}}}, made);
  EXPECT_EQ(run.inputs, (std::vector<InputRecord>{{"pyramid.glint", "22"}, {"pyramid.glint/map.glint", "11"}}));
  EXPECT_FALSE(isChained(run.inputs[0]));
  EXPECT_TRUE(isChained(run.inputs[1]));
}

TEST(Provenance, NormalsOfAnotherMapAreRefusedForCompressedPyramidsToo) {
  const test::TempFolder folder;
  auto other = test::sampleNormals(64, 64);
  writeAsset(folder / "map.glint", other.map, test::sampleProvenance());
  std::vector<Vec2> changed(other.map.normals.begin(), other.map.normals.end());
  changed[5] = {0.1f, 0.2f};
  NormalMap another = other.map;
  another.normals = changed;
  another.bounds_level_count = 0;
  writeAsset(folder / "another.glint", another, test::sampleProvenance());
  const auto sample = test::sampleNdfCp(64, CompressionMethod::cp, CoefficientType::i8);
  const Provenance pyramid = {"glint-pyramid", "{}", {{"map.glint", hashFile(folder / "map.glint")}}};
  const Provenance run = chained({"glint-compress", "{}", {{"pyramid.glint", std::string(32, '0')}}}, pyramid);
  writeAsset(folder / "cp.glint", sample.ndf, run);
  const auto open = [&](const char* asset, const char* normals) {
    api::NdfOptions options;
    options.normals = folder / normals;
    return api::OpenedNdf::open(folder / asset, options).hasNormals();
  };
  EXPECT_TRUE(open("cp.glint", "map.glint"));
  try {
    open("cp.glint", "another.glint");
    ADD_FAILURE();
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::invalid_input);
    EXPECT_NE(std::string(error.what()).find("give the asset that glint-pyramid read, map.glint"), std::string::npos);
  }
  // A file that does not name the map: only sizes can be compared.
  writeAsset(folder / "old.glint", sample.ndf, {"glint-compress", "{}", {{"pyramid.glint", std::string(32, '0')}}});
  EXPECT_TRUE(open("old.glint", "another.glint"));
}

}  // namespace
}  // namespace glint::formats::provenance_test
