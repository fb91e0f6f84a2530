#pragma once

#include <nanobind/nanobind.h>

namespace glint::python {

/// Ndf, Brdf and Displaced: handles of the C interface, and their batches on several threads.
void bindNdf(nanobind::module_& m);
void bindBrdf(nanobind::module_& m);
void bindDisplaced(nanobind::module_& m);

}  // namespace glint::python
