// Writes the golden files of format version 1.0: small assets made from formulas (support/sample_assets.cpp), one for each kind
// and each way to store it. Files of a released version are frozen: run this only for a new version, into its own folder.

#include <cstdio>
#include <filesystem>
#include <string>

#include "support/sample_assets.h"

int main(int argc, char** argv) {
  using namespace glint;
  if (argc != 2) {
    std::fprintf(stderr, "usage: glint-make-golden FOLDER\n");
    return 1;
  }
  try {
    const std::filesystem::path folder = argv[1];
    for (const test::SampleAsset& sample : test::sampleAssets())
      writeAsset(folder / (std::string(sample.name) + ".glint"), sample.make().asset, test::sampleProvenance());
  } catch (const Error& error) {
    std::fprintf(stderr, "glint-make-golden: error: %s\n", error.what());
    return static_cast<int>(error.code());
  }
  return 0;
}
