#pragma once

#include <initializer_list>
#include <limits>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

namespace glint::apps {

/// A member of a JSON document that a person wrote, and its path in it, such as "materials[0].tolerance", for errors.
class JsonField {
 public:
  /// Reads a document.
  /// @throws Error io; invalid_input if the file is no JSON object
  static JsonField read(const std::string& path);
  JsonField(std::string file, std::string path, const nlohmann::json& value)
      : file_(std::move(file)), path_(std::move(path)), value_(value) {}

  /// A member of an object.
  /// @throws Error invalid_input if it is missing; `remedy` says what to give
  JsonField member(const std::string& name, const std::string& remedy) const;
  std::optional<JsonField> find(const std::string& name) const;
  /// Throws Error invalid_input if this is no object, or has a member of another name.
  void allow(std::initializer_list<const char*> names) const;
  /// The elements of an array that is not empty.
  std::vector<JsonField> elements() const;

  std::string text() const;
  /// One of some words.
  std::string word(const std::vector<std::string>& words) const;
  bool flag() const;
  /// A number from low to high; `more` is added to the error of another one.
  double number(double low, double high = std::numeric_limits<double>::max(), const std::string& more = {}) const;
  /// A number above 0.
  double positive() const { return number(std::numeric_limits<double>::min()); }
  int integer(int low, int high) const;

  bool isText() const { return value_.is_string(); }
  const nlohmann::json& value() const { return value_; }
  [[noreturn]] void refuse(const std::string& what, const std::string& remedy) const;

 private:
  std::string file_, path_;
  nlohmann::json value_;
};

}  // namespace glint::apps
