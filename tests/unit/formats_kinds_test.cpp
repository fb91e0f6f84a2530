// What holds for every kind of asset, by what its description says: a new kind is tested here as soon as it has a sample.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <iterator>
#include <set>

#include "glint/formats/asset_reader.h"
#include "glint/formats/asset_writer.h"
#include "glint/formats/conformance.h"
#include "glint/formats/kinds/kind.h"
#include "glint/formats/validate.h"
#include "support/sample_assets.h"
#include "support/source_folder.h"
#include "support/temp_folder.h"

namespace glint::formats::formats_kinds_test {
namespace {

namespace fs = std::filesystem;
using test::SampleAsset;

std::string bytesOf(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

const Kind& kindOf(const test::OwnedAsset& sample) { return *kinds()[sample.asset.index()]; }

class EveryKind : public testing::TestWithParam<SampleAsset> {
 protected:
  EveryKind() : path_(folder_ / "a.glint"), sample_(GetParam().make()), kind_(kindOf(sample_)) {
    writeAsset(path_, sample_.asset, test::sampleProvenance());
  }

  /// What the file holds, to be broken.
  FileStructure structure() const {
    Findings findings(path_);
    FileStructure read = readStructure(FileBytes::ofFile(path_, false), findings);
    EXPECT_FALSE(findings.failed());
    return read;
  }

  /// Attributes of the schema that the file has: samples lack none that must be there.
  std::vector<AttributeSchema> presentAttributes() const {
    const FileStructure file = structure();
    std::vector<AttributeSchema> present;
    for (const AttributeSchema& attribute : kind_.schema.attributes) {
      const bool found = file.attributes.contains(attribute.name);
      EXPECT_TRUE(found || !attribute.required) << attribute.name;
      if (found) present.push_back(attribute);
    }
    return present;
  }

  /// "rule object" of everything in which a structure differs from the schema.
  std::set<std::string> broken(const FileStructure& structure) const {
    Findings findings(path_);
    checkConformance(structure, kind_.schema, findings);
    std::set<std::string> rules;
    for (const Finding& finding : findings.report().findings) rules.insert(finding.rule + " " + finding.object);
    return rules;
  }

  /// Paths of a dataset of the schema that the file has.
  std::vector<std::string> pathsOf(const FileStructure& structure, const DatasetSchema& dataset) const {
    std::set<std::string> paths;
    for (int level = 0; level < 20; ++level)
      if (structure.datasets.contains(levelPath(dataset.path, level))) paths.insert(levelPath(dataset.path, level));
    return {paths.begin(), paths.end()};
  }

  const test::TempFolder folder_;
  const fs::path path_;
  const test::OwnedAsset sample_;
  const Kind& kind_;
};

INSTANTIATE_TEST_SUITE_P(Samples, EveryKind, testing::ValuesIn(test::sampleAssets()), [](const auto& parameter) {
  std::string name = parameter.param.name;
  std::replace(name.begin(), name.end(), '-', '_');
  return name;
});

TEST(Kinds, HaveSamplesAndAreSorted) {
  std::set<std::string_view> sampled, known;
  for (const SampleAsset& sample : test::sampleAssets()) sampled.insert(kindOf(sample.make()).schema.name);
  for (const Kind* kind : kinds()) {
    EXPECT_TRUE(known.empty() || *known.rbegin() < kind->schema.name) << kind->schema.name;
    known.insert(kind->schema.name);
    EXPECT_EQ(findKind(kind->schema.name), kind);
  }
  EXPECT_EQ(sampled, known);
  EXPECT_EQ(findKind("unknown"), nullptr);
}

TEST(Kinds, NameEachAttributeAndArrayOnce) {
  for (const Kind* kind : kinds()) {
    std::set<std::string_view> names, paths;
    for (const AttributeSchema& attribute : kind->schema.attributes) {
      EXPECT_TRUE(names.insert(attribute.name).second) << attribute.name;
      EXPECT_LE(attribute.minimum, attribute.maximum) << attribute.name;
      EXPECT_FALSE(attribute.long_name.empty() || attribute.units.empty()) << attribute.name;
    }
    for (const DatasetSchema& dataset : kind->schema.datasets) {
      EXPECT_TRUE(paths.insert(dataset.path).second) << dataset.path;
      EXPECT_FALSE(dataset.long_name.empty() || dataset.units.empty()) << dataset.path;
    }
  }
}

TEST(Kinds, OptionalValuesNeedAllOfTheirAttributes) {
  const test::TempFolder folder;
  auto sample = test::sampleNormals(64, 48);
  sample.map.slopes = MapSlopes{{0.5f, 0.25f}, {1, 0, 1}};
  writeAsset(folder / "a.glint", sample.map, test::sampleProvenance());
  Findings findings(folder / "a.glint");
  FileStructure file = readStructure(FileBytes::ofFile(folder / "a.glint", false), findings);
  const auto slopes = [&] { return std::get<NormalMap>(formats::kindOf<NormalMap>().read(file)).slopes; };
  ASSERT_TRUE(slopes());
  EXPECT_EQ(slopes()->mean.x, 0.5f);
  file.attributes.erase("slope_covariance");
  EXPECT_FALSE(slopes());
}

TEST_P(EveryKind, IsWrittenAsItsGoldenFile) {
  const fs::path golden = test::goldenFolder() / (std::string(GetParam().name) + ".glint");
  EXPECT_EQ(bytesOf(path_), bytesOf(golden)) << golden;
}

TEST_P(EveryKind, IsValidAndKnowsItsKind) {
  EXPECT_THAT(validateAsset(path_).findings, testing::IsEmpty());
  const Asset asset = Asset::openForBuilding(path_);
  EXPECT_EQ(asset.kind(), kind_.schema.name);
  EXPECT_EQ(asset.any().index(), sample_.asset.index());
}

TEST_P(EveryKind, ComesBackBitExact) {
  const Asset asset = Asset::open(path_);
  const PackedAsset before = kind_.pack(sample_.asset), after = kind_.pack(asset.any());
  ASSERT_EQ(before.attributes.size(), after.attributes.size());
  for (std::size_t k = 0; k < before.attributes.size(); ++k) {
    EXPECT_EQ(before.attributes[k].first, after.attributes[k].first);
    EXPECT_EQ(before.attributes[k].second.numbers, after.attributes[k].second.numbers) << before.attributes[k].first;
    EXPECT_EQ(before.attributes[k].second.texts, after.attributes[k].second.texts) << before.attributes[k].first;
  }
  ASSERT_EQ(before.arrays.size(), after.arrays.size());
  for (std::size_t k = 0; k < before.arrays.size(); ++k) {
    const PackedArray &a = before.arrays[k], &b = after.arrays[k];
    EXPECT_EQ(a.path, b.path);
    EXPECT_EQ(a.dims, b.dims) << a.path;
    ASSERT_EQ(a.size_bytes, b.size_bytes) << a.path;
    const auto bytes = [](const PackedArray& array) {
      return std::string_view(static_cast<const char*>(array.data), static_cast<std::size_t>(array.size_bytes));
    };
    if (a.size_bytes > 0) {
      EXPECT_EQ(bytes(a), bytes(b)) << a.path;
    }
  }
}

TEST_P(EveryKind, TellsTheAttributesOfItsSchema) {
  std::vector<std::string> expected, told;
  for (const AttributeSchema& attribute : presentAttributes()) expected.emplace_back(attribute.name);
  const Asset asset = Asset::open(path_);
  for (const AttributeInfo& attribute : asset.info().attributes) told.push_back(attribute.name);
  EXPECT_EQ(told, expected);
}

TEST_P(EveryKind, NeedsEachAttribute) {
  for (const AttributeSchema& attribute : presentAttributes()) {
    if (!attribute.required && attribute.needs.empty()) continue;  // files may lack it
    FileStructure file = structure();
    file.attributes.erase(file.attributes.find(attribute.name));
    EXPECT_THAT(broken(file), testing::Contains("attribute.missing /@" + std::string(attribute.name)));
  }
}

TEST_P(EveryKind, RefusesAttributesOfAnotherType) {
  for (const AttributeSchema& attribute : presentAttributes()) {
    FileStructure file = structure();
    file.attributes.find(attribute.name)->second.type = ElementType::u8;
    EXPECT_THAT(broken(file), testing::Contains("attribute.type /@" + std::string(attribute.name)));
  }
}

TEST_P(EveryKind, RefusesAttributesOutOfRange) {
  for (const AttributeSchema& attribute : presentAttributes()) {
    const auto expectRefused = [&](auto change) {
      FileStructure file = structure();
      change(file.attributes.find(attribute.name)->second);
      EXPECT_THAT(broken(file), testing::Contains("attribute.value /@" + std::string(attribute.name)));
    };
    if (attribute.type == ElementType::text) {
      expectRefused([](AttributeValue& value) { value.texts[0] = "neither"; });
      continue;
    }
    for (const double bad : {attribute.minimum - std::max(1.0, std::abs(attribute.minimum)),
                             attribute.maximum + std::max(1.0, std::abs(attribute.maximum)), std::nan("")})
      expectRefused([&](AttributeValue& value) { value.numbers.back() = bad; });
  }
}

TEST_P(EveryKind, NeedsEachArray) {
  for (const DatasetSchema& dataset : kind_.schema.datasets) {
    for (const std::string& path : pathsOf(structure(), dataset)) {
      FileStructure file = structure();
      file.datasets.erase(path);
      EXPECT_THAT(broken(file), testing::Contains("dataset.missing /" + path));
    }
  }
}

TEST_P(EveryKind, RefusesArraysOfAnotherTypeOrRank) {
  for (const DatasetSchema& dataset : kind_.schema.datasets) {
    for (const std::string& path : pathsOf(structure(), dataset)) {
      FileStructure file = structure();
      file.datasets.at(path).type = ElementType::text;
      EXPECT_THAT(broken(file), testing::ElementsAre("dataset.type /" + path));
      file = structure();
      file.datasets.at(path).dims.push_back(1);
      EXPECT_THAT(broken(file), testing::ElementsAre("dataset.dims /" + path));
    }
  }
}

TEST_P(EveryKind, WarnsOfWhatItsSchemaDoesNotHave) {
  FileStructure file = structure();
  file.attributes["colour"] = {ElementType::i32, true, {1}, {}};
  file.datasets["colours"] = file.datasets.begin()->second;
  EXPECT_THAT(broken(file), testing::UnorderedElementsAre("attribute.unknown /@colour", "dataset.unknown /colours"));
}

}  // namespace
}  // namespace glint::formats::formats_kinds_test
