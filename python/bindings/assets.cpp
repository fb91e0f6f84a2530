#include "assets.h"

#include <nanobind/stl/string.h>

#include <nlohmann/json.hpp>
#include <string>

#include "glint-info/summary.h"
#include "glint/formats/asset_reader.h"
#include "glint/formats/hash.h"
#include "glint/formats/validate.h"

namespace glint::python {
namespace {

namespace nb = nanobind;

/// The result of `glint-info --json`, as text.
std::string summary(const std::string& path) {
  const nb::gil_scoped_release others_may_run;
  return apps::summarize(formats::Asset::open(path)).dump();
}

nb::tuple validate(const std::string& path, bool hashes, bool data) {
  formats::ValidationReport report;
  {
    const nb::gil_scoped_release others_may_run;
    report = formats::validateAsset(path, {hashes, data});
  }
  nb::list findings;
  for (const formats::Finding& f : report.findings)
    findings.append(nb::make_tuple(f.rule, std::string(formats::name(f.severity)), f.object, f.message, f.remedy));
  return nb::make_tuple(report.kind, findings);
}

/// The kind of an asset that is fit for building from: values and hashes are checked, too.
std::string kindOf(const std::string& path, bool for_building) {
  const nb::gil_scoped_release others_may_run;
  return std::string((for_building ? formats::Asset::openForBuilding(path) : formats::Asset::open(path)).kind());
}

}  // namespace

void bindAssets(nb::module_& m) {
  m.def("summary", &summary);
  m.def("validate", &validate);
  m.def("kind_of", &kindOf);
  m.def("hash_file", [](const std::string& path) { return formats::hashFile(path); });
  m.def("version", [] { return std::string(GLINT_VERSION); });
}

}  // namespace glint::python
