/*
 * glint, the C interface: ask a precomputed asset how the normals inside a footprint are distributed.
 *
 * Conventions
 *  - uv: texture space, periodic; any finite uv is valid. v points up.
 *  - Half vectors are points (x, y) of the unit disk in the tangent frame, z = sqrt(1 - x^2 - y^2).
 *  - Densities are per unit projected area, >= 0: the microfacet D whose integral against the cosine is 1.
 *  - Sizes are in texels of the normal map.
 *
 * Errors: every function that can fail returns a glint_status and leaves its outputs untouched unless it is GLINT_OK.
 * glint_error_message() then says what, where, and what to do. Queries fail for null arguments only: numbers that are not
 * finite or out of range have defined answers, given with each function. No C++ exception leaves the library.
 *
 * Threads: a glint_ndf is immutable; any number of threads may ask it at once. Opening is thread-safe (one file at a time) and
 * uses HDF5 while it lasts: a program with HDF5 code of its own on other threads must keep it apart from that. Queries do not
 * use HDF5, and allocate nothing.
 *
 * Versions: three numbers, each with its rule. GLINT_ABI_VERSION, the number in the name of the shared library, rises when a
 * program has to be compiled again; functions, kinds and members at the end of sized structs come without that. glint_version()
 * is that of the project. Files have a version of their own, which opening checks.
 */
#ifndef GLINT_H
#define GLINT_H

#include <stddef.h>
#include <stdint.h>

#define GLINT_ABI_VERSION 1

#if defined(__GNUC__)
#define GLINT_API __attribute__((visibility("default")))
#else
#define GLINT_API
#endif

#ifdef __cplusplus
extern "C" {
#endif

/* Classes of errors that a caller treats differently; the same numbers as the exit codes of the tools. */
typedef int32_t glint_status;
enum {
  GLINT_OK = 0,
  GLINT_ERROR_USAGE = 1,         /* an argument is null or out of range */
  GLINT_ERROR_IO = 2,            /* a file cannot be opened or read */
  GLINT_ERROR_INVALID_INPUT = 3, /* a file was read, but what it holds breaks a rule of the format */
  GLINT_ERROR_FAILED = 4,        /* out of memory, or another failure of the work itself */
  GLINT_ERROR_UNSUPPORTED = 5    /* a newer version of the format, or a kind that holds no distribution */
};

/* GLINT_ABI_VERSION of the library that is loaded. Compare with the macro where the library is loaded by hand. */
GLINT_API int32_t glint_abi_version(void);

/* Version of the project, "MAJOR.MINOR.PATCH"; never null. */
GLINT_API const char* glint_version(void);

/* Message of the last call on this thread that did not return GLINT_OK: what, where, and what to do; "" if there was none.
 * Never null; valid until the next such call on this thread. */
GLINT_API const char* glint_error_message(void);

/* Stable id of the rule that was broken, such as "format.kind"; "" if there is none. Same lifetime as the message. */
GLINT_API const char* glint_error_rule(void);

/* A distribution of normals over a texture, opened from an asset. */
typedef struct glint_ndf glint_ndf;

enum { GLINT_SURFACE_FLAT = 0, GLINT_SURFACE_SMOOTH = 1 };
enum { GLINT_BOUNDARY_WRAP = 0, GLINT_BOUNDARY_CLAMP = 1 };

/* What an asset does not say itself. Zero is the default of every member but the first; options of other kinds are ignored, but
 * have to be in range. Members are added at the end; a library that does not know one accepts 0 there. */
typedef struct glint_open_options {
  size_t struct_size;       /* sizeof(glint_open_options) */
  const char* normals_path; /* asset of kind normals that the pyramid was made from: it answers footprints below level 0,
                               which the nearest level answers without it. Null: none */
  float sigma_r;            /* kind normals: intrinsic roughness, disk units, 1e-4 to 0.25; 0: 0.005 */
  int32_t surface;          /* kind normals: GLINT_SURFACE_* */
  int32_t boundary;         /* kind normals: GLINT_BOUNDARY_* */
  int32_t verify_hashes;    /* not 0: compare every dataset with its hash; reads the whole file */
  float alpha;              /* kind bin-map: Beckmann roughness, in the range that the asset was made for; 0: the smallest */
  float slant_tolerance;    /* kind histogram-sat: share of a footprint with slanted sides that may be counted in a wrong
                               place, up to 1; 0: 0.06; GLINT_SLANT_EXACT: none, and slower */
  int32_t gaussian_boxes;   /* kind histogram-sat: boxes that stand for a Gaussian footprint, 1 or 3; 0: 1 */
  int32_t reserved;         /* 0 */
} glint_open_options;

#define GLINT_SLANT_EXACT (-1.0f)

/* clang-format off */
#define GLINT_OPEN_OPTIONS_INIT { sizeof(glint_open_options), NULL, 0.0f, 0, 0, 0, 0.0f, 0.0f, 0, 0 }
/* clang-format on */

/* Opens an asset of any kind that holds a distribution of normals: normals, ndf-pyramid, ndf-cp, bin-map, histogram-sat.
 *
 * The file is checked, then mapped; what queries read is not copied. Safe on untrusted files. A file must not be changed in
 * place while it is open (the tools never do: they replace files).
 * path: UTF-8, not null. options: null for the defaults. ndf: receives the handle, not null.
 * Returns GLINT_ERROR_USAGE for null path or ndf, or options out of range; IO, INVALID_INPUT and UNSUPPORTED as listed above. */
GLINT_API glint_status glint_ndf_open(const char* path, const glint_open_options* options, glint_ndf** ndf);

/* Closes a handle; null is ignored. No thread may be asking it. */
GLINT_API void glint_ndf_close(glint_ndf* ndf);

/* What a handle is. Members are added at the end; the library fills those that fit into struct_size. */
typedef struct glint_ndf_info {
  size_t struct_size;        /* set by the caller: sizeof(glint_ndf_info) */
  const char* kind;          /* "normals", "ndf-pyramid", ...; lives as long as the handle */
  int32_t width;             /* of the normal map, texels */
  int32_t height;            /* of the normal map, texels */
  int32_t resolution;        /* pixels along each axis of a stored NDF image; 256 where there are none */
  int32_t level_count;       /* footprint sizes that are stored; 0: all sizes are answered from the texels */
  float sigma_r;             /* intrinsic roughness, disk units */
  float finest_sigma_texels; /* footprint of level 0, deviation in texels; 0 where there are no levels */
  int32_t surface;           /* GLINT_SURFACE_* */
  int32_t boundary;          /* GLINT_BOUNDARY_* */
  int32_t has_normals;       /* 1: footprints below level 0 are answered from the texels */
  int32_t reserved;          /* 0 */
  uint64_t file_bytes;       /* size of the asset */
} glint_ndf_info;

/* Fills info. Returns GLINT_ERROR_USAGE for null arguments or a struct_size that does not reach beyond itself. */
GLINT_API glint_status glint_ndf_get_info(const glint_ndf* ndf, glint_ndf_info* info);

/* The region of texture space that a shading point sees. */
enum { GLINT_FOOTPRINT_GAUSSIAN = 0, GLINT_FOOTPRINT_BOX = 1 };
typedef struct glint_footprint {
  int32_t kind; /* GLINT_FOOTPRINT_*; other values count as Gaussian */
  float u, v;   /* centre */
  float m[4];   /* Gaussian: covariance xx, xy, yy in texels^2, and unused. Box: a parallelogram's half axes ax, ay, bx, by
                   in texels */
} glint_footprint;

/* Isotropic Gaussian of deviation sigma, texels. */
GLINT_API glint_footprint glint_footprint_isotropic(float u, float v, float sigma_texels);

/* Density towards one half vector.
 *
 * 0 outside the square |x|, |y| <= 1 and for half vectors that are not numbers. Footprints: a centre that is not finite counts
 * as 0; sizes that are too small or not finite count as the narrowest footprint, those larger than the map as the map.
 * Returns GLINT_ERROR_USAGE for null arguments, else GLINT_OK. */
GLINT_API glint_status glint_density(const glint_ndf* ndf, const glint_footprint* footprint, float hx, float hy,
                                     float* density);

/* Mean density over the box [x0, x1] x [y0, y1] of half vectors, as a light or a pixel of an NDF image asks for it.
 *
 * Counts 0 outside the square [-1, 1]^2; 0 for a box that is empty or not finite. Footprints and status as for glint_density. */
GLINT_API glint_status glint_mean(const glint_ndf* ndf, const glint_footprint* footprint, float x0, float y0, float x1,
                                  float y1, float* mean);

/* Draws a half vector in proportion to the density.
 *
 * (xi1, xi2): random numbers in [0, 1), stratified ones stay stratified; others are clamped, NaN counts as 0.
 * (hx, hy): the half vector. It may lie outside the unit disk, where facets near the horizon blur to: no direction.
 * pdf: its density per unit projected area, the density over its integral; 0 if nothing can be drawn, and hx = hy = 0 then. Multiply by the
 * half vector's z for a density per unit solid angle of half vectors. Footprints and status as for glint_density. */
GLINT_API glint_status glint_sample(const glint_ndf* ndf, const glint_footprint* footprint, float xi1, float xi2, float* hx,
                                    float* hy, float* pdf);

/* Floats of a batch: element k is at data + k * stride bytes. A contiguous array has the stride sizeof(float), a member of an
 * array of structs that of the struct; with stride 0 all queries share one value. Every address must be that of a float. */
typedef struct glint_floats {
  const float* data; /* null: not given */
  ptrdiff_t stride;  /* bytes; may be negative */
} glint_floats;

/* Footprints of a batch. u, v and one of sigma; xx and yy, with or without xy; ax, ay, bx and by must be given. If several are
 * given, the first of them counts. Zero the struct first. */
typedef struct glint_footprints {
  glint_floats u, v;           /* centres */
  glint_floats sigma;          /* isotropic Gaussians: deviation, texels */
  glint_floats xx, xy, yy;     /* Gaussians: covariance, texels^2 */
  glint_floats ax, ay, bx, by; /* boxes: half axes, texels */
} glint_footprints;

/* densities[k] = glint_density of query k, k < count, to 1e-6 of its size; densities is contiguous.
 *
 * count = 0 is valid and reads nothing, so that pointers may then be null. Returns GLINT_ERROR_USAGE for null pointers or a
 * missing array, else GLINT_OK. Outputs must not overlap inputs. To use threads, split the batch. */
GLINT_API glint_status glint_density_batch(const glint_ndf* ndf, size_t count, const glint_footprints* footprints,
                                           glint_floats hx, glint_floats hy, float* densities);

/* means[k] = glint_mean of query k; as glint_density_batch. */
GLINT_API glint_status glint_mean_batch(const glint_ndf* ndf, size_t count, const glint_footprints* footprints, glint_floats x0,
                                        glint_floats y0, glint_floats x1, glint_floats y1, float* means);

/* (hx[k], hy[k]) and pdfs[k] = glint_sample of query k; the three arrays are contiguous. Else as glint_density_batch. */
GLINT_API glint_status glint_sample_batch(const glint_ndf* ndf, size_t count, const glint_footprints* footprints,
                                          glint_floats xi1, glint_floats xi2, float* hx, float* hy, float* pdfs);

#ifdef __cplusplus
}
#endif

#endif
