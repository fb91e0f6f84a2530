#include "glint/formats/choices.h"

namespace glint::formats {
namespace {

/// Takes the part before the next separator, or all, off the front of a list.
std::string_view takePart(std::string_view& list, char separator) {
  const std::size_t end = list.find(separator);
  const std::string_view part = list.substr(0, end);
  list.remove_prefix(end == std::string_view::npos ? list.size() : end + 1);
  return part;
}

std::string_view trimmed(std::string_view text) {
  while (!text.empty() && text.front() == ' ') text.remove_prefix(1);
  while (!text.empty() && text.back() == ' ') text.remove_suffix(1);
  return text;
}

}  // namespace

int indexOf(std::string_view text, std::string_view choices) {
  for (int index = 0; !choices.empty(); ++index)
    if (takePart(choices, '|') == text) return index;
  return -1;
}

std::string_view choiceAt(std::string_view choices, int index) {
  for (; index > 0 && !choices.empty(); --index) takePart(choices, '|');
  return index < 0 ? std::string_view() : takePart(choices, '|');
}

bool conditionHolds(std::string_view when, const Attributes& attributes) {
  while (!when.empty()) {
    std::string_view values = takePart(when, '&');
    const auto found = attributes.find(trimmed(takePart(values, '=')));
    if (found == attributes.end() || found->second.texts.size() != 1) return false;
    if (indexOf(found->second.texts[0], trimmed(values)) < 0) return false;
  }
  return true;
}

}  // namespace glint::formats
