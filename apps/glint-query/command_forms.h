#pragma once

#include <string>
#include <vector>

namespace glint::apps {

/// How glint-query is asked one sort of question, and the options that only such questions have. Other questions point to it
/// when they are given one of its options.
struct CommandForm {
  std::string line;
  std::vector<std::string> options;
};

inline const CommandForm kDistributionForm = {
    "glint-query ASSET --uv U V --sigma S --half HX HY",
    {"--half", "--range", "--csv", "--samples", "--image", "--image-size", "--repeat", "--normals", "--parts", "--alpha"}};
inline const CommandForm kLightForm = {"glint-query light ASSET --light TABLE --uv U V --sigma S --wo X Y Z",
                                       {"--light", "--lobes", "--order", "--window", "--tolerance", "--ndf-epsilon",
                                        "--fresnel", "--ior", "--eta", "--k", "--shadowing", "--smith"}};
inline const CommandForm kReflectanceForm = {"glint-query reflectance ASSET --uv U V --sigma S --wi X Y Z --wo X Y Z",
                                             {"--wi", "--level", "--variant"}};
inline const CommandForm kPlaneForm = {"glint-query plane ASSET --texel X Y --sigma S --half HX HY", {"--texel"}};

}  // namespace glint::apps
