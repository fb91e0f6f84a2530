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

  const glint_brdf_options gold = {
      sizeof gold, GLINT_FRESNEL_CONDUCTOR, 0, {0.18f, 0.42f, 1.37f}, {3.42f, 2.35f, 1.77f}}; /* indices of r, g, b */
  glint_brdf* brdf;
  if (glint_brdf_create(ndf, &gold, &brdf) == GLINT_OK) {
    const float wi[3] = {0.6f, 0, 0.8f}, wo[3] = {-0.48f, 0, 0.8773f}; /* z out of the surface */
    float f[3], pdf;
    glint_brdf_evaluate(brdf, &footprint, wi, wo, f, &pdf);
    printf("reflected %g %g %g\n", f[0], f[1], f[2]);
    glint_brdf_destroy(brdf);
  }
  glint_ndf_close(ndf);
  return 0;
}
