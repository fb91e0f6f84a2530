#pragma once

#include <string>

namespace CLI {
class Option;
}  // namespace CLI

namespace glint::apps {

/// A declared option, for the constraints that are checked while the command line is parsed.
class Option {
 public:
  Option& required();
  /// Numbers outside [low, high] are a usage error. Applies to each element of a list.
  Option& range(double low, double high);
  /// Makes the option a list of exactly `values` values, given as `a b c` or `a,b,c`.
  Option& count(int values);
  Option& excludes(const Option& other);
  Option& needs(const Option& other);
  /// Leaves the option out of the `command` record, because it does not change the result.
  Option& unrecorded();
  /// Leaves the option out of the `command` record where it is not given.
  Option& recordedIfGiven();
  /// Sets a text that the help shows instead of the default value, for defaults that depend on other options.
  Option& defaultText(const std::string& text);
  /// Whether the command line or the configuration file set it. Valid after parsing.
  bool given() const;

 private:
  friend class Tool;
  CLI::Option* option_ = nullptr;
  bool recorded_ = true;
  bool only_if_given_ = false;
};

}  // namespace glint::apps
