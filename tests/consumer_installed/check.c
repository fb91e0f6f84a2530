/* Asks the library everything that its header promises: check ASSET. Exits with the number of broken promises. */
#include <glint.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static int broken = 0;

static void check(int holds, const char* promise) {
  if (holds) return;
  fprintf(stderr, "broken: %s (last error: %s)\n", promise, glint_error_message());
  ++broken;
}

enum { COUNT = 37 };

/* One struct for each query, as a renderer's wavefront may have them. */
typedef struct query {
  float u, v, sigma, hx, hy;
} query;

static void check_batches(const glint_ndf* ndf) {
  /* Exactly as much memory as the header asks for, so that a step beyond it is seen. */
  query* queries = malloc(COUNT * sizeof *queries);
  float* answers = malloc(COUNT * sizeof *answers);
  float* means = malloc(COUNT * sizeof *means);
  glint_footprints footprints;
  memset(&footprints, 0, sizeof footprints);
  for (int k = 0; k < COUNT; ++k) {
    const float t = (float)k / COUNT;
    const query q = {t, 1 - t, 1 + 60 * t, 0.4f * t - 0.2f, 0.1f - 0.2f * t};
    queries[k] = q;
  }
  const ptrdiff_t stride = sizeof(query);
  const glint_floats u = {&queries->u, stride}, v = {&queries->v, stride}, sigma = {&queries->sigma, stride};
  const glint_floats hx = {&queries->hx, stride}, hy = {&queries->hy, stride};
  const float low = -0.1f, high = 0.2f;
  const glint_floats x0 = {&low, 0}, x1 = {&high, 0};
  footprints.u = u;
  footprints.v = v;
  footprints.sigma = sigma;
  check(glint_density_batch(ndf, COUNT, &footprints, hx, hy, answers) == GLINT_OK, "a batch of densities");
  check(glint_mean_batch(ndf, COUNT, &footprints, x0, x0, x1, x1, means) == GLINT_OK, "a batch of means");
  for (int k = 0; k < COUNT; ++k) {
    const glint_footprint p = glint_footprint_isotropic(queries[k].u, queries[k].v, queries[k].sigma);
    float one = -1;
    glint_density(ndf, &p, queries[k].hx, queries[k].hy, &one);
    check(fabsf(one - answers[k]) <= 1e-6f * one, "densities of a batch are those of single queries");
    glint_mean(ndf, &p, low, low, high, high, &one);
    check(fabsf(one - means[k]) <= 1e-6f * one, "means of a batch are those of single queries");
  }
  const glint_floats none = {NULL, sizeof(float)};
  check(glint_density_batch(ndf, 0, NULL, none, none, NULL) == GLINT_OK, "no query needs no pointers");
  check(glint_density_batch(ndf, COUNT, &footprints, none, hy, answers) == GLINT_ERROR_USAGE, "hx must be given");
  check(glint_density_batch(ndf, COUNT, NULL, hx, hy, answers) == GLINT_ERROR_USAGE, "footprints must be given");
  check(glint_density_batch(ndf, COUNT, &footprints, hx, hy, NULL) == GLINT_ERROR_USAGE, "answers must be given");
  footprints.sigma = none;
  check(glint_density_batch(ndf, COUNT, &footprints, hx, hy, answers) == GLINT_ERROR_USAGE, "a size must be given");
  free(queries);
  free(answers);
  free(means);
}

static void check_bad_arguments(const glint_ndf* ndf) {
  const glint_footprint p = glint_footprint_isotropic(0.5f, 0.5f, 20);
  const glint_footprint odd = glint_footprint_isotropic(NAN, INFINITY, NAN);
  float value = -1;
  check(glint_density(NULL, &p, 0, 0, &value) == GLINT_ERROR_USAGE && value == -1, "a null handle is an error");
  check(strlen(glint_error_message()) > 0, "an error has a message");
  check(glint_density(ndf, NULL, 0, 0, &value) == GLINT_ERROR_USAGE && value == -1, "a null footprint is an error");
  check(glint_density(ndf, &p, NAN, 0, &value) == GLINT_OK && value == 0, "the density towards NaN is 0");
  check(glint_density(ndf, &p, 2, 0, &value) == GLINT_OK && value == 0, "the density outside the square is 0");
  check(glint_density(ndf, &odd, 0, 0, &value) == GLINT_OK && value >= 0 && isfinite(value), "any footprint has an answer");
  check(glint_mean(ndf, &p, 0, 0, 0, 0, &value) == GLINT_OK && value == 0, "the mean over an empty box is 0");
  check(glint_mean(ndf, &p, -1, -1, 1, 1, &value) == GLINT_OK && fabsf(value - 0.25f) < 0.02f, "the density integrates to 1");
}

static void check_opening(const char* path) {
  glint_ndf* ndf = NULL;
  check(glint_ndf_open("no-such-file.glint", NULL, &ndf) == GLINT_ERROR_IO && ndf == NULL, "a missing file is an error");
  check(strstr(glint_error_message(), "no-such-file.glint") != NULL, "the message names the file");
  check(glint_ndf_open(NULL, NULL, &ndf) == GLINT_ERROR_USAGE, "a null path is an error");
  check(glint_ndf_open(path, NULL, NULL) == GLINT_ERROR_USAGE, "a null handle pointer is an error");
  glint_open_options options = GLINT_OPEN_OPTIONS_INIT;
  options.sigma_r = -1;
  check(glint_ndf_open(path, &options, &ndf) == GLINT_ERROR_USAGE, "a negative roughness is an error");
  options.sigma_r = 0;
  options.slant_tolerance = -0.5f;
  check(glint_ndf_open(path, &options, &ndf) == GLINT_ERROR_USAGE, "a negative tolerance is an error");
  options.slant_tolerance = GLINT_SLANT_EXACT;
  options.gaussian_boxes = 2;
  check(glint_ndf_open(path, &options, &ndf) == GLINT_ERROR_USAGE, "Gaussians are 1 or 3 boxes");
  options.gaussian_boxes = 3;
  check(glint_ndf_open(path, &options, &ndf) == GLINT_OK, "options of other kinds are ignored");
  glint_ndf_close(ndf);
  ndf = NULL;
  options.struct_size = 1;
  check(glint_ndf_open(path, &options, &ndf) == GLINT_ERROR_USAGE, "options need their size");
  check(ndf == NULL, "a failed call leaves its outputs untouched");
  glint_ndf_close(NULL);
}

int main(int argc, char** argv) {
  glint_ndf* ndf = NULL;
  if (argc != 2) return 99;
  check(glint_abi_version() == GLINT_ABI_VERSION, "header and library are of one ABI");
  check(strchr(glint_version(), '.') != NULL, "the library knows its version");
  check(strcmp(glint_error_message(), "") == 0, "before the first error there is no message");
  check_opening(argv[1]);
  if (glint_ndf_open(argv[1], NULL, &ndf) != GLINT_OK) {
    fprintf(stderr, "%s\n", glint_error_message());
    return 98;
  }
  glint_ndf_info info;
  info.struct_size = sizeof info;
  check(glint_ndf_get_info(ndf, &info) == GLINT_OK && info.width > 0 && info.height > 0, "an asset says its size");
  check(info.struct_size == sizeof info, "the size of the struct is kept");
  check_bad_arguments(ndf);
  check_batches(ndf);
  printf("%s, %d x %d texels, %d levels: %d broken promises\n", info.kind, (int)info.width, (int)info.height,
         (int)info.level_count, broken);
  glint_ndf_close(ndf);
  return broken;
}
