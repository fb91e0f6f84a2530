#include "glint-bench/report_page.h"

#include <string_view>

#include "common/files.h"

// The files of page/, inside the program. GLINT_BENCH_PAGE is their folder.
#define GLINT_EMBED(name, file)                                                                                         \
  asm(".section .rodata\n.global glint_page_" #name "\n.global glint_page_" #name "_end\n.balign 16\nglint_page_" #name \
      ":\n.incbin \"" GLINT_BENCH_PAGE "/" file "\"\nglint_page_" #name "_end:\n.byte 0\n.previous\n");                 \
  extern "C" const char glint_page_##name[];                                                                            \
  extern "C" const char glint_page_##name##_end[]

GLINT_EMBED(d3, "d3.min.js");
GLINT_EMBED(plot, "plot.umd.min.js");
GLINT_EMBED(style, "report.css");
GLINT_EMBED(script, "report.js");
GLINT_EMBED(body, "report.html");
GLINT_EMBED(stability_script, "stability.js");
GLINT_EMBED(stability_body, "stability.html");
GLINT_EMBED(preset_script, "preset.js");
GLINT_EMBED(preset_body, "preset.html");
GLINT_EMBED(licences, "LICENSES.txt");

namespace glint::apps {
namespace {

std::string_view text(const char* begin, const char* end) { return {begin, static_cast<std::size_t>(end - begin)}; }

/// JSON as it may stand inside an element of a page: no tag can begin in it.
std::string forPage(const nlohmann::ordered_json& document) {
  std::string json = document.dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace);
  for (std::size_t at = json.find('<'); at != std::string::npos; at = json.find('<', at)) json.replace(at, 1, "\\u003c");
  return json;
}

/// Writes a page of this body, which this script fills from the document.
void writePage(const nlohmann::ordered_json& document, std::string_view body, std::string_view script,
               const std::string& path) {
  std::string page =
      "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n<meta name=\"generator\" "
      "content=\"glint-bench\">\n"
      "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n<title>glint-bench</title>\n<style>\n";
  page += text(glint_page_style, glint_page_style_end);
  page += "</style>\n</head>\n<body>\n";
  page += body;
  page += "<script type=\"application/json\" id=\"results\">" + forPage(document) + "</script>\n";
  page += "<!-- The libraries inside this page:\n\n";
  page += text(glint_page_licences, glint_page_licences_end);
  page += "-->\n";
  for (const std::string_view part :
       {text(glint_page_d3, glint_page_d3_end), text(glint_page_plot, glint_page_plot_end), script}) {
    page += "<script>\n";
    page += part;
    page += "\n</script>\n";
  }
  writeTextFile(path, page + "</body>\n</html>\n");
}

}  // namespace

void writeReportPage(const nlohmann::ordered_json& document, ResultForm form, const std::string& path) {
  switch (form) {
    case ResultForm::measurements:
      return writePage(document, text(glint_page_body, glint_page_body_end), text(glint_page_script, glint_page_script_end),
                       path);
    case ResultForm::stability:
      return writePage(document, text(glint_page_stability_body, glint_page_stability_body_end),
                       text(glint_page_stability_script, glint_page_stability_script_end), path);
    case ResultForm::preset:
      return writePage(document, text(glint_page_preset_body, glint_page_preset_body_end),
                       text(glint_page_preset_script, glint_page_preset_script_end), path);
  }
}

}  // namespace glint::apps
