#include "failure.h"

#include <nanobind/stl/string.h>

#include "glint/model/error.h"

namespace glint::python {
namespace {

namespace nb = nanobind;

void raise(int code, const std::string& rule, const std::string& path, const std::string& message) {
  const nb::object made = nb::module_::import_("glint_ndf.errors").attr("error_of")(code, rule, path, message);
  PyErr_SetObject(reinterpret_cast<PyObject*>(Py_TYPE(made.ptr())), made.ptr());
}

}  // namespace

void registerErrors() {
  nb::register_exception_translator([](const std::exception_ptr& thrown, void*) {
    try {
      std::rethrow_exception(thrown);
    } catch (const Failure& failure) {
      raise(failure.status(), failure.rule(), "", failure.what());
    } catch (const Error& error) {
      raise(static_cast<int>(error.code()), error.rule(), error.path(), error.what());
    }
  });
}

}  // namespace glint::python
