// The C++ side of an installed glint: check ASSET, of any kind that answers an NDF.
#include <glint.h>

#include <cmath>
#include <cstdio>

#include "glint/api/any_ndf.h"
#include "glint/formats/asset_reader.h"
#include "glint/query/cp_ndf.h"

int main(int argc, char** argv) try {
  if (argc != 2) return 99;
  const auto opened = glint::api::OpenedNdf::open(argv[1]);
  const auto footprint = glint::Footprint::isotropic({0.3f, 0.7f}, 40);
  const glint::Vec2 half = {0.1f, -0.05f};
  const float density = opened.model().density(footprint, half);
  const auto asset = glint::formats::Asset::open(argv[1]);
  const float typed = asset.kind() == "ndf-cp" ? glint::CpNdf(asset.get<glint::NdfCp>()).density(footprint, half) : density;

  glint_ndf* ndf = nullptr;
  float c_density = -1;
  const glint_footprint c_footprint = glint_footprint_isotropic(0.3f, 0.7f, 40);
  if (glint_ndf_open(argv[1], nullptr, &ndf) != GLINT_OK) return 98;
  glint_density(ndf, &c_footprint, half.x, half.y, &c_density);
  glint_ndf_close(ndf);

  const float tolerance = 1e-5f * density;  // the queries here and in the library may be compiled for different processors
  std::printf("density %g, through the asset %g, through C %g\n", density, typed, c_density);
  return std::fabs(typed - density) <= tolerance && std::fabs(c_density - density) <= tolerance ? 0 : 1;
} catch (const glint::Error& error) {
  std::fprintf(stderr, "%s\n", error.what());
  return 97;
}
