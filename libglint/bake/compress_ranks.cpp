#include "glint/bake/compress_ranks.h"

#include <algorithm>

namespace glint::bake {

RankAllocator::RankAllocator(const std::vector<ClusterModel>& models) : models_(models) {
  double error = 0;
  for (std::size_t c = 0; c < models.size(); ++c) {
    const auto& choices = models[c].choices();
    error += choices[0].error;
    for (std::size_t i = 1; i < choices.size(); ++i) {
      const double gain = choices[i - 1].error - choices[i].error;
      const auto bytes = static_cast<double>(choices[i].bytes - choices[i - 1].bytes);
      steps_.push_back({gain / bytes, static_cast<std::uint32_t>(c), static_cast<std::uint32_t>(i)});
    }
  }
  // Gains fall along a hull, so a stable sort keeps the steps of a cluster in order.
  std::stable_sort(steps_.begin(), steps_.end(),
                   [](const Step& a, const Step& b) { return a.gain_per_byte > b.gain_per_byte; });
  errors_.push_back(error);
  for (const Step& step : steps_) {
    const auto& choices = models[step.cluster].choices();
    error -= choices[step.choice - 1].error - choices[step.choice].error;
    errors_.push_back(error);
  }
}

std::vector<int> RankAllocator::allocate(double squared_error) const {
  std::vector<int> selection(models_.size(), 0);
  for (std::size_t i = 0; i < steps_.size() && errors_[i] > squared_error; ++i)
    selection[steps_[i].cluster] = static_cast<int>(steps_[i].choice);
  return selection;
}

double RankAllocator::gainPerByte(double squared_error) const {
  double gain = 0;
  for (std::size_t i = 0; i < steps_.size() && errors_[i] > squared_error; ++i) gain = steps_[i].gain_per_byte;
  return gain;
}

double RankAllocator::error(const std::vector<int>& selection) const {
  double sum = 0;
  for (std::size_t c = 0; c < models_.size(); ++c) sum += models_[c].choices()[selection[c]].error;
  return sum;
}

}  // namespace glint::bake
