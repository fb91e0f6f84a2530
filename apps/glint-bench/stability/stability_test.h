#pragma once

#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "glint-bench/lab/bench_lab.h"

namespace glint::apps {

/// The curves of one test: a figure of each method for each value of what is changed.
class StabilityCurves {
 public:
  struct Point {
    std::string series;  ///< a method, or another thing that is compared
    double x = 0;
    double value = 0;
    std::string message;  ///< why there is no value; empty: there is one
  };

  /// Sets the value of x of the points that are added next.
  void at(double x) { x_ = x; }
  void add(std::string_view series, double value) { points_.push_back({std::string(series), x_, value, {}}); }
  void fail(std::string_view series, std::string message) {
    points_.push_back({std::string(series), x_, 0, std::move(message)});
  }

  const std::vector<Point>& points() const { return points_; }

 private:
  double x_ = 0;
  std::vector<Point> points_;
};

/// What methods do as one thing grows, up to where they fail.
struct StabilityTest {
  std::string name;                          ///< "moving"
  std::string title;                         ///< "The footprint moves by 1/8 of a texel"
  std::string question;                      ///< one or two sentences: the map, what is changed and what the figure is
  std::string axis;                          ///< what is changed, with its unit
  std::string figure;                        ///< what is measured; 0 or 1 is best, more is worse
  double tolerable = 0;                      ///< largest figure of a method that holds
  std::string instead;                       ///< one sentence: what to do where a method does not hold
  std::vector<double> values, quick_values;  ///< of the axis, ascending
  /// Measures at one value, and adds a point for each series.
  std::function<void(BenchLab&, double, StabilityCurves&)> measure;
};

/// Adds the value of every method that has one. What fails is in the message of its point.
void addEach(StabilityCurves& curves, BenchLab& lab, const std::vector<Candidate>& methods, const LabMap& map,
             const LabQuestion& question, const std::function<double(const api::OpenedNdf&)>& value);

/// Every test, in the order of the page. This is the one list.
std::vector<StabilityTest> stabilityTests();

// Private to stabilityTests: the tests of one subject each.

std::vector<StabilityTest> motionTests();
std::vector<StabilityTest> footprintTests();
std::vector<StabilityTest> surfaceTests();
std::vector<StabilityTest> compressionTests();
std::vector<StabilityTest> lightTests();
std::vector<StabilityTest> reliefTests();

}  // namespace glint::apps
