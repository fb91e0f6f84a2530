#include "glint/formats/size_expression.h"

#include <cctype>
#include <charconv>

namespace glint::formats {
namespace {

/// Recursive descent over one size expression.
class SizeParser {
 public:
  SizeParser(std::string_view source, const SizeScope& scope) : rest_(source), scope_(scope) {}

  std::optional<std::uint64_t> parse() {
    const auto value = sum();
    skipSpace();
    return rest_.empty() ? value : std::nullopt;
  }

 private:
  using Value = std::optional<std::uint64_t>;

  void skipSpace() {
    while (!rest_.empty() && rest_.front() == ' ') rest_.remove_prefix(1);
  }
  bool take(char c) {
    skipSpace();
    if (rest_.empty() || rest_.front() != c) return false;
    rest_.remove_prefix(1);
    return true;
  }

  Value sum() {
    Value left = product();
    while (left && take('+')) {
      const Value right = product();
      std::uint64_t total = 0;
      if (!right || __builtin_add_overflow(*left, *right, &total)) return std::nullopt;
      left = total;
    }
    return left;
  }

  Value product() {
    Value left = factor();
    while (left && take('*')) {
      const Value right = factor();
      std::uint64_t total = 0;
      if (!right || __builtin_mul_overflow(*left, *right, &total)) return std::nullopt;
      left = total;
    }
    return left;
  }

  Value factor() {
    if (take('(')) {
      const Value value = sum();
      return take(')') ? value : std::nullopt;
    }
    std::size_t length = 0;
    while (length < rest_.size() && (std::isalnum(static_cast<unsigned char>(rest_[length])) || rest_[length] == '_')) ++length;
    const std::string_view word = rest_.substr(0, length);
    rest_.remove_prefix(length);
    if (word.empty()) return std::nullopt;
    if (std::isdigit(static_cast<unsigned char>(word.front()))) {
      std::uint64_t number = 0;
      const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), number);
      return error == std::errc() && end == word.data() + word.size() ? Value(number) : std::nullopt;
    }
    if (word == "ceil_div" || word == "pow2") return call(word);
    return lookUp(word);
  }

  Value call(std::string_view function) {
    if (!take('(')) return std::nullopt;
    const Value a = sum();
    if (function == "pow2") return a && *a < 63 && take(')') ? Value(std::uint64_t{1} << *a) : std::nullopt;
    if (!a || !take(',')) return std::nullopt;
    const Value b = sum();
    if (!b || *b == 0 || !take(')')) return std::nullopt;
    return *a / *b + (*a % *b != 0);
  }

  Value lookUp(std::string_view word) {
    if (word == "l") return scope_.level;
    const auto found = scope_.values.find(word);
    std::uint64_t index = 0;
    if (take('[')) {
      const Value at = sum();
      if (!at || !take(']')) return std::nullopt;
      index = *at;
    }
    if (found == scope_.values.end() || index >= found->second.size()) return std::nullopt;
    return found->second[index];
  }

  std::string_view rest_;
  const SizeScope& scope_;
};

}  // namespace

std::optional<std::uint64_t> evaluateSize(std::string_view expression, const SizeScope& scope) {
  return SizeParser(expression, scope).parse();
}

}  // namespace glint::formats
