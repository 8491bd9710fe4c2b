#pragma once

#include <filesystem>
#include <map>
#include <string>

#include <Eigen/Core>

#include "urdf/reader/robot_model.h"

namespace walkman {

/// The meshes named in a URDF, each read once.
class MeshFiles {
 public:
  MeshFiles(const std::filesystem::path& urdf_file, PackagePath packages);

  /// Mesh at `uri`, vertices multiplied by `scale` (a mirroring scale also reverses the triangles, so that
  /// they stay counter-clockwise seen from outside).
  ///
  /// `package://NAME/rest` is looked up in every package folder, then in the folders above the URDF that are
  /// called NAME; `file://` and plain paths are used as given, relative ones starting from the URDF's folder.
  /// Throws std::runtime_error if there is no such file (with every path tried), or if it is unreadable, has
  /// no triangles or is too large.
  const MeshShape& load(const std::string& uri, const Eigen::Vector3d& scale);

 private:
  [[nodiscard]] std::filesystem::path find(const std::string& uri) const;

  std::filesystem::path urdf_folder_;
  PackagePath packages_;
  std::map<std::string, MeshShape> loaded_;
};

}  // namespace walkman
