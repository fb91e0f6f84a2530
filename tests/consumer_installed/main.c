#include <glint.h>
#include <stdio.h>

int main(int argc, char** argv) {
  glint_ndf* ndf;
  if (argc < 2 || glint_ndf_open(argv[1], NULL, &ndf) != GLINT_OK) {
    fprintf(stderr, "%s\n", argc < 2 ? "usage: app ASSET" : glint_error_message());
    return 1;
  }
  const glint_footprint footprint = glint_footprint_isotropic(0.3f, 0.7f, 40); /* centre in uv, deviation in texels */
  float density, mean;
  glint_density(ndf, &footprint, 0.1f, -0.05f, &density);
  glint_mean(ndf, &footprint, 0.05f, -0.1f, 0.15f, 0.0f, &mean);
  printf("density %g\nmean over a light %g\n", density, mean);
  glint_ndf_close(ndf);
  return 0;
}
