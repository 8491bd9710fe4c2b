#pragma once

#include <filesystem>
#include <map>
#include <string>

#include <Eigen/Core>

#include "urdf/reader/robot_model.h"

namespace walkman {

/// The meshes a URDF names, each read once.
class MeshFiles {
 public:
  MeshFiles(const std::filesystem::path& urdf_file, PackagePath packages);

  /// Mesh at `uri`, vertices multiplied by `scale` (a mirroring scale turns the triangles too, so that they
  /// stay counter-clockwise from outside).
  ///
  /// `package://NAME/rest` is looked up in every package folder, then in the folders above the URDF that are
  /// called NAME; `file://` and plain paths as they are, relative ones from the URDF's folder. Throws
  /// std::runtime_error: no such file (with every path tried), unreadable, no triangles, too large.
  const MeshShape& load(const std::string& uri, const Eigen::Vector3d& scale);

 private:
  [[nodiscard]] std::filesystem::path find(const std::string& uri) const;

  std::filesystem::path urdf_folder_;
  PackagePath packages_;
  std::map<std::string, MeshShape> loaded_;
};

}  // namespace walkman
