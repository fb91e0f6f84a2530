// HDF5 is the judge of the project's own reader: both read the same of every file.

#ifndef H5_USE_110_API
#define H5_USE_110_API
#endif
#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <filesystem>
#include <set>

#include "glint/formats/asset_writer.h"
#include "glint/formats/hdf5_handle.h"
#include "glint/formats/structure.h"
#include "support/sample_assets.h"
#include "support/source_folder.h"
#include "support/temp_folder.h"

namespace glint::formats::formats_judge_test {
namespace {

namespace fs = std::filesystem;
using hdf5::Handle;

Handle opened(hid_t id, const std::string& object) { return Handle(id, "cannot be opened", object); }

/// Compares what HDF5 reads with what the reader made of the same file.
class Judge {
 public:
  Judge(const fs::path& path, const FileStructure& file) : path_(path), file_(file) {}

  void compare() {
    const Handle root = opened(H5Fopen(path_.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT), path_.string());
    compareGroup(root, "");
    EXPECT_EQ(groups_.size(), file_.groups.size() + 1);
    EXPECT_EQ(datasets_.size(), file_.datasets.size());
  }

 private:
  static herr_t collect(hid_t, const char* name, const H5L_info_t*, void* names) {
    static_cast<std::vector<std::string>*>(names)->emplace_back(name);
    return 0;
  }

  void compareGroup(hid_t location, const std::string& path) {
    groups_.insert(path);
    const Handle group = opened(H5Gopen2(location, path.empty() ? "/" : path.c_str(), H5P_DEFAULT), path);
    compareAttributes(group, path.empty() ? file_.attributes : file_.groups.at(path), path);
    std::vector<std::string> names;
    ASSERT_GE(H5Literate(group, H5_INDEX_NAME, H5_ITER_INC, nullptr, &collect, &names), 0);
    for (const std::string& name : names) {
      const std::string child = path.empty() ? name : path + "/" + name;
      H5O_info_t info;
      ASSERT_GE(H5Oget_info_by_name2(group, name.c_str(), &info, H5O_INFO_BASIC, H5P_DEFAULT), 0);
      if (info.type == H5O_TYPE_GROUP) {
        compareGroup(location, child);
      } else {
        compareDataset(location, child);
      }
    }
  }

  void compareDataset(hid_t location, const std::string& path) {
    datasets_.insert(path);
    ASSERT_TRUE(file_.datasets.contains(path)) << path;
    const DatasetRecord& record = file_.datasets.at(path);
    const Handle dataset = opened(H5Dopen2(location, path.c_str(), H5P_DEFAULT), path);
    const Handle type = opened(H5Dget_type(dataset), path), space = opened(H5Dget_space(dataset), path);
    ElementType found{};
    EXPECT_TRUE(types_.find(type, found) && found == record.type) << path;
    std::vector<hsize_t> dims(static_cast<std::size_t>(H5Sget_simple_extent_ndims(space)));
    H5Sget_simple_extent_dims(space, dims.data(), nullptr);
    EXPECT_TRUE(std::equal(dims.begin(), dims.end(), record.dims.begin(), record.dims.end())) << path;
    std::vector<std::byte> bytes(record.size_bytes);
    ASSERT_EQ(H5Tget_size(type) * static_cast<std::size_t>(H5Sget_simple_extent_npoints(space)), bytes.size()) << path;
    ASSERT_GE(H5Dread(dataset, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, bytes.data()), 0) << path;
    EXPECT_TRUE(std::equal(bytes.begin(), bytes.end(), record.data)) << path;
    compareAttributes(dataset, record.attributes, path);
  }

  void compareAttributes(hid_t object, const Attributes& attributes, const std::string& path) {
    H5O_info_t info;
    ASSERT_GE(H5Oget_info2(object, &info, H5O_INFO_NUM_ATTRS), 0);
    EXPECT_EQ(info.num_attrs, attributes.size()) << path;
    for (const auto& [name, value] : attributes) {
      const std::string place = path + "@" + name;
      const Handle attribute = opened(H5Aopen(object, name.c_str(), H5P_DEFAULT), place);
      const Handle type = opened(H5Aget_type(attribute), place), space = opened(H5Aget_space(attribute), place);
      EXPECT_EQ(value.scalar, H5Sget_simple_extent_type(space) == H5S_SCALAR) << place;
      ASSERT_EQ(static_cast<std::size_t>(H5Sget_simple_extent_npoints(space)), value.count()) << place;
      if (value.count() == 0) continue;
      if (value.type == ElementType::text) {
        compareTexts(attribute, type, value, place);
      } else {
        std::vector<double> numbers(value.count());
        ASSERT_GE(H5Aread(attribute, H5T_NATIVE_DOUBLE, numbers.data()), 0) << place;
        EXPECT_EQ(numbers, value.numbers) << place;
      }
    }
  }

  static void compareTexts(hid_t attribute, hid_t type, const AttributeValue& value, const std::string& place) {
    const std::size_t width = H5Tget_size(type);
    std::vector<char> chars(width * value.count());
    ASSERT_GE(H5Aread(attribute, type, chars.data()), 0) << place;
    for (std::size_t k = 0; k < value.count(); ++k) {
      const char* text = chars.data() + k * width;
      EXPECT_EQ(std::string(text, ::strnlen(text, width)), value.texts[k]) << place;
    }
  }

  fs::path path_;
  const FileStructure& file_;
  hdf5::TypeTable types_;
  std::set<std::string> groups_, datasets_;
};

void judge(const fs::path& path) {
  SCOPED_TRACE(path.string());
  Findings findings(path);
  const FileStructure file = readStructure(FileBytes::ofFile(path, false), findings);
  EXPECT_TRUE(findings.report().findings.empty());
  Judge(path, file).compare();
}

TEST(Judge, Hdf5ReadsTheSameOfEverySample) {
  const test::TempFolder folder;
  for (const test::SampleAsset& sample : test::sampleAssets()) {
    const fs::path path = folder / (std::string(sample.name) + ".glint");
    writeAsset(path, sample.make().asset, test::sampleProvenance());
    judge(path);
  }
}

TEST(Judge, Hdf5ReadsTheSameOfEveryGoldenFile) {
  std::size_t count = 0;
  for (const auto& entry : fs::directory_iterator(test::goldenFolder())) {
    judge(entry.path());
    ++count;
  }
  EXPECT_GE(count, 20u);
}

}  // namespace
}  // namespace glint::formats::formats_judge_test
