#pragma once

#include <memory>
#include <string>
#include <vector>

#include "common/tool.h"
#include "glint-query/distribution_command.h"
#include "glint-query/footprint_options.h"
#include "glint-query/output_options.h"
#include "glint/query/wang_plane.h"
#include "glint/query/wang_reference.h"

namespace glint::apps {

/// `glint-query plane`: how normals are distributed at a point of an endless plane of Wang tiles: a density, a mean, or a picture.
class PlaneCommand {
 public:
  explicit PlaneCommand(Tool& tool);
  void run();

 private:
  void check() const;
  /// @tparam Plane  WangReference or WangPlane
  template <class Plane>
  void ask(const Plane& tiles);
  template <class Plane>
  void writePicture(const Plane& plane, const Footprint& footprint);

  Tool& tool_;
  std::string path_;
  std::vector<double> texel_;
  std::unique_ptr<FootprintSize> size_;  // its options come after --texel
  HalfVectorOptions halves_;
  PictureOptions picture_;
  Surface surface_ = Surface::flat;
  float sigma_r_ = 0.005f;
  int repeat_ = 0;
};

}  // namespace glint::apps
