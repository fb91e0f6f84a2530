#pragma once

#include <nanobind/nanobind.h>

namespace glint::python {

/// Reading what a file is: summary, validate and hash.
void bindAssets(nanobind::module_& m);

/// Builders: each reads an asset or an array and writes an asset.
void bindBuilders(nanobind::module_& m);

}  // namespace glint::python
