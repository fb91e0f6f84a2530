#include <nanobind/nanobind.h>

#include "assets.h"
#include "failure.h"
#include "footprints.h"
#include "ndf.h"

// The functions here take plain arrays of queries. Package glint_ndf gives them shapes, defaults and docstrings.
NB_MODULE(_glint, m) {
  using namespace glint::python;
  registerErrors();
  bindFootprints(m);
  bindNdf(m);
  bindBrdf(m);
  bindDisplaced(m);
  bindAssets(m);
  bindBuilders(m);
}
