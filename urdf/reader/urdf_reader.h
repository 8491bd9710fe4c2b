#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include <tinyxml2.h>
#include <urdf_model/model.h>

#include "urdf/reader/mesh_file.h"
#include "urdf/reader/robot_model.h"
#include "urdf/reader/urdf_finding.h"

namespace walkman {

/// Turns one URDF file into a RobotModel: uses tinyxml2 to find errors and their location, urdfdom to
/// interpret the contents.
class UrdfReader {
 public:
  UrdfReader(std::filesystem::path urdf_file, PackagePath packages, UrdfFindings::OnFinding on_finding);

  [[nodiscard]] RobotModel read();
  [[nodiscard]] const std::vector<UrdfFinding>& findings() const { return findings_.all(); }
  /// The document as read, without the parts that `findings` names; valid after `read`.
  [[nodiscard]] const tinyxml2::XMLDocument& document() const { return xml_; }

 private:
  void add_link(const urdf::Link& link, int parent_joint);
  void add_subtree(const urdf::ModelInterface& tree, const urdf::Link& link, int parent_joint);

  std::filesystem::path file_;
  MeshFiles meshes_;
  UrdfFindings findings_;
  tinyxml2::XMLDocument xml_;
  std::map<std::string, int> joint_order_;   ///< place of each joint in the file
  std::map<std::string, Surface> surfaces_;  ///< of links that specify one
  RobotModel model_;
};

}  // namespace walkman
