#include "common/option.h"

#include <CLI/CLI.hpp>

#include "common/number_checks.h"
#include "common/numbers.h"

namespace glint::apps {

Option& Option::required() {
  option_->required();
  return *this;
}

Option& Option::range(double low, double high) {
  option_->transform(numberRange(low, high));  // before the check of the type, whose range is wider
  double number = 0;
  if (parseNumber(option_->get_default_str(), number).empty() && !(number >= low && number <= high)) option_->default_str("");
  return *this;
}

Option& Option::count(int values) {
  option_->expected(values);
  return *this;
}

Option& Option::excludes(const Option& other) {
  option_->excludes(other.option_);
  return *this;
}

Option& Option::needs(const Option& other) {
  option_->needs(other.option_);
  return *this;
}

Option& Option::unrecorded() {
  recorded_ = false;
  return *this;
}

Option& Option::recordedIfGiven() {
  only_if_given_ = true;
  return *this;
}

Option& Option::defaultText(const std::string& text) {
  option_->default_str(text);
  return *this;
}

bool Option::given() const { return option_->count() > 0; }

}  // namespace glint::apps
