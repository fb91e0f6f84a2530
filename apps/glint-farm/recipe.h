#pragma once

#include <initializer_list>
#include <string>
#include <vector>

namespace glint::apps {

/// A kind of asset, as pipelines/glint.mk names it, and the program that makes it.
struct RecipeKind {
  const char* name;                                  ///< "pyramid"
  const char* suffix;                                ///< of the file: NAME.pyramid.glint
  const char* source;                                ///< kind that it is made of; empty: the image
  std::initializer_list<const char*> command;        ///< program, and the flags that make it this kind
  std::initializer_list<const char*> default_flags;  ///< unless flags are given
};

/// One word of the flags of a step.
struct RecipeFlag {
  std::string word;
  bool names_file;  ///< it is a file that the program reads
};

/// One step of a recipe.
struct RecipeStep {
  const RecipeKind* kind;
  std::vector<RecipeFlag> flags;
};

/// What to make of every image: the kinds that are asked for, and those that they are made of, sources first.
/// @param asked  "KIND" or "KIND FLAGS", as glint-farm plan --make has them
/// @throws Error usage
std::vector<RecipeStep> recipeOf(const std::vector<std::string>& asked);

/// Names of all kinds, as "normals, heights, ...".
std::string recipeKindNames();

/// Endings of the names of images, without the point, as pipelines/glint.mk has them.
const std::vector<std::string>& imageTypes();

}  // namespace glint::apps
