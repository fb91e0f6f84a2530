#pragma once

#include <string>
#include <vector>

namespace glint::apps {

/// A method at one setting: the program that makes its asset, and what from.
struct Candidate {
  std::string method;              ///< "tucker"
  std::string setting;             ///< "tolerance 0.1"; empty: the method has no parameters
  std::string tool;                ///< "glint-compress"; empty: the map itself is asked, by brute force
  std::vector<std::string> flags;  ///< of the tool
  std::string source;              ///< name of the candidate whose asset is the input; empty: the map
  bool takes_normals = false;      ///< footprints below level 0 are answered from the map

  /// "tucker, tolerance 0.1"
  std::string name() const { return setting.empty() ? method : method + ", " + setting; }
};

/// Every method, in the order in which assets are made from each other. This is the one list: a new method is measured by a line
/// here.
/// @param quick  one setting of each method
std::vector<Candidate> benchCandidates(bool quick);

/// Names of the methods, each once.
std::vector<std::string> benchMethods();

}  // namespace glint::apps
