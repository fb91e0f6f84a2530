// Writes the golden files of format version 1.0: small assets made from formulas (support/sample_assets.cpp), one for each kind
// and each way to store it. Files of a released version are frozen: run this only for a new version, into its own folder.

#include <cstdio>
#include <filesystem>

#include "support/sample_assets.h"

int main(int argc, char** argv) {
  using namespace glint;
  if (argc != 2) {
    std::fprintf(stderr, "usage: glint-make-golden FOLDER\n");
    return 1;
  }
  try {
    const std::filesystem::path folder = argv[1];
    const formats::Provenance provenance = test::sampleProvenance();
    writeAsset(folder / "normals.glint", test::sampleNormals(64, 48).map, provenance);
    writeAsset(folder / "heights.glint", test::sampleHeights(64, 48).map, provenance);
    writeAsset(folder / "displacement.glint", test::sampleDisplacement(64).displacement, provenance);
    writeAsset(folder / "displacement-rgb.glint", test::sampleDisplacement(64, true).displacement, provenance);
    writeAsset(folder / "ndf-pyramid.glint", test::samplePyramid(64, BlockPrecision::f16).pyramid, provenance);
    writeAsset(folder / "histogram-sat.glint", test::sampleHistograms(22, 19).sat, provenance);
    using enum CompressionMethod;
    writeAsset(folder / "ndf-cp-cp-i8.glint", test::sampleNdfCp(64, cp, CoefficientType::i8).ndf, provenance);
    writeAsset(folder / "ndf-cp-tucker-f16.glint", test::sampleNdfCp(64, tucker, CoefficientType::f16).ndf, provenance);
    writeAsset(folder / "ndf-cp-pca-i8.glint", test::sampleNdfCp(64, pca, CoefficientType::i8).ndf, provenance);
    writeAsset(folder / "ndf-cp-narrow-i8.glint",
               test::sampleNdfCp(64, tucker, CoefficientType::i8, test::SampleForm::narrow).ndf, provenance);
    writeAsset(folder / "ndf-cp-spots-i8.glint",
               test::sampleNdfCp(64, tucker, CoefficientType::i8, test::SampleForm::spots).ndf, provenance);
    writeAsset(folder / "ndf-cp-cp-f32.glint", test::sampleNdfCp(64, cp, CoefficientType::f32).ndf, provenance);
    writeAsset(folder / "bin-map.glint", test::sampleBinMap(64, 48).map, provenance);
    writeAsset(folder / "sh-lobes.glint", test::sampleShLobes().lobes, provenance);
    writeAsset(folder / "sh-light.glint", test::sampleShLight().light, provenance);
  } catch (const Error& error) {
    std::fprintf(stderr, "glint-make-golden: error: %s\n", error.what());
    return static_cast<int>(error.code());
  }
  return 0;
}
