#pragma once

#include <CLI/CLI.hpp>
#include <set>
#include <string>

namespace glint::apps {

/// Help texts that name the values and the constraints of an option in words: `--wi FLOAT FLOAT FLOAT (needs --wo)`.
class HelpFormatter : public CLI::Formatter {
 public:
  std::string make_option_opts(const CLI::Option* option) const override;
};

}  // namespace glint::apps
