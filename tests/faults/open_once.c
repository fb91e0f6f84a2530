// Opens an asset through the C interface, asks it once and closes it, as a renderer does.
// open_once ASSET prints a density; or the message of an error, and exits with its code.

#include <stdio.h>

#include "glint.h"

static int fail(glint_status status) {
  fprintf(stderr, "open_once: error: %s\n", glint_error_message());
  return status;
}

int main(int argc, char** argv) {
  if (argc != 2) return GLINT_ERROR_USAGE;
  glint_ndf* ndf = NULL;
  glint_status status = glint_ndf_open(argv[1], NULL, &ndf);
  if (status != GLINT_OK) return fail(status);
  const glint_footprint footprint = {GLINT_FOOTPRINT_GAUSSIAN, 0.3f, 0.6f, {9, 0, 9, 0}, {0, 0}};
  float density = 0;
  status = glint_density(ndf, &footprint, 0.1f, -0.05f, &density);
  if (status != GLINT_OK) return fail(status);
  printf("%.9g\n", density);
  glint_ndf_close(ndf);
  return GLINT_OK;
}
