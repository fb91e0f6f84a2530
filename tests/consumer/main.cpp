#include <cstdio>

#include "glint/formats/asset_reader.h"
#include "glint/query/cp_ndf.h"

int main(int, char** argv) try {
  const auto asset = glint::formats::Asset::open(argv[1]);  // checked, then mapped: nothing is copied
  const glint::CpNdf ndf(asset.get<glint::NdfCp>());
  const auto footprint = glint::Footprint::isotropic({0.3f, 0.7f}, 40);  // centre in uv, deviation in texels
  std::printf("density %g\n", ndf.density(footprint, {0.1f, -0.05f}));
  std::printf("mean over a light %g\n", ndf.mean(footprint, {{0.05f, -0.1f}, {0.15f, 0.0f}}));
} catch (const glint::Error& error) {
  std::fprintf(stderr, "%s\n", error.what());
  return 1;
}
