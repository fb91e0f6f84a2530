#pragma once

#include <array>
#include <string>
#include <string_view>

namespace glint::apps {

// Columns of the tables that glint-query reads and writes. A table of answers is a table of queries with columns behind it.

inline constexpr std::array kCentre = {"u", "v"};
inline constexpr std::array kSigma = {"sigma"};
inline constexpr std::array kCovariance = {"sxx", "sxy", "syy"};
inline constexpr std::array kBox = {"ax", "ay", "bx", "by"};
inline constexpr std::array kLevel = {"level"};
inline constexpr std::array kHalf = {"hx", "hy"};
inline constexpr std::array kSpread = {"spread_x", "spread_y"};
inline constexpr std::array kRange = {"x0", "y0", "x1", "y1"};
inline constexpr std::array kLight = {"wix", "wiy", "wiz"};
inline constexpr std::array kView = {"wox", "woy", "woz"};

inline constexpr const char* kDensity = "density";
inline constexpr const char* kMean = "mean";
inline constexpr const char* kReflected = "reflected";
inline constexpr std::array kReflectedRgb = {"reflected_r", "reflected_g", "reflected_b"};

inline constexpr const char* kHalfVectorSamples = "hx,hy,pdf";
inline constexpr const char* kLightSamples = "wix,wiy,wiz,pdf";

/// The name by which a column is found: in small letters, without the blanks around it.
std::string columnKey(std::string_view name);

/// Whether the first line of a file is the header of a table that glint-query writes: samples, or queries with their answers.
bool isAnswerHeader(std::string_view line);

}  // namespace glint::apps
