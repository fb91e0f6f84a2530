#pragma once

#include <memory>
#include <type_traits>

#include "glint.h"

namespace glint::python {

/// Owns a handle of the C interface.
template <class Handle, void (*kClose)(Handle*)>
class Owned {
 public:
  explicit Owned(Handle* handle) : handle_(handle, kClose) {}
  const Handle* get() const { return handle_.get(); }

 private:
  std::shared_ptr<Handle> handle_;
};

using Ndf = Owned<glint_ndf, glint_ndf_close>;
using Brdf = Owned<glint_brdf, glint_brdf_destroy>;
using Displaced = Owned<glint_displaced, glint_displaced_close>;

}  // namespace glint::python
