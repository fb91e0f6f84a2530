#pragma once

// Private to formats/: what findings say of elements that break a rule.

#include <cstddef>
#include <string>
#include <string_view>

#include "glint/formats/findings.h"
#include "glint/model/counted.h"
#include "glint/model/texel_name.h"

namespace glint::formats {

/// Counts elements and remembers the first.
class Tally {
 public:
  void add(std::size_t element) {
    if (count_++ == 0) first_ = element;
  }
  std::size_t count() const { return count_; }
  std::size_t first() const { return first_; }

 private:
  std::size_t count_ = 0;
  std::size_t first_ = 0;
};

/// "2 values are not finite (first at element 3)".
inline std::string faultText(std::size_t count, const Subject& subject, std::string_view what, const std::string& first) {
  return counted(count, subject) + " " + std::string(what) + " (first " + first + ")";
}

/// Reports elements that break a rule, if there are any: how many, and the first.
/// @param subject, what  e.g. {"value is", "values are"}, "not finite"
/// @param place          text of the place of an element, e.g. "at element 3"
template <class Place>
void report(const Tally& tally, std::string_view rule, const std::string& object, const Subject& subject, std::string_view what,
            Findings& findings, Place place) {
  if (tally.count() > 0) findings.add(rule, object, faultText(tally.count(), subject, what, place(tally.first())));
}

/// Reports texels that break a rule.
inline void report(const TexelTally& tally, std::string_view rule, const std::string& object, const Subject& subject,
                   std::string_view what, Findings& findings) {
  if (tally.count() > 0) findings.add(rule, object, faultText(tally.count(), subject, what, "at " + tally.firstName()));
}

/// Reports the elements of an array for which holds(element) is false.
template <class Condition>
void reportUnless(std::size_t count, Condition holds, std::string_view rule, const std::string& object, const Subject& subject,
                  std::string_view what, Findings& findings) {
  Tally bad;
  for (std::size_t k = 0; k < count; ++k)
    if (!holds(k)) bad.add(k);
  report(bad, rule, object, subject, what, findings, [](std::size_t k) { return "at element " + std::to_string(k); });
}

}  // namespace glint::formats
