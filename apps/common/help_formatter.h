#pragma once

#include <CLI/CLI.hpp>
#include <set>
#include <string>

namespace glint::apps {

/// Help texts that say in words what an option takes: `--wo FLOAT FLOAT FLOAT (needs --light)`.
class HelpFormatter : public CLI::Formatter {
 public:
  std::string make_option_opts(const CLI::Option* option) const override;
};

}  // namespace glint::apps
