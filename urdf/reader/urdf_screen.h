#pragma once

#include <map>
#include <string>

#include "urdf/reader/robot_model.h"

namespace tinyxml2 {
class XMLDocument;
}

namespace walkman {

class MeshFiles;
class UrdfFindings;

/// Parses the text of a URDF. Throws std::runtime_error with file and line if it is not well-formed XML with
/// a named <robot>, or is still a xacro.
void parse_urdf_xml(const std::string& file, const std::string& text, tinyxml2::XMLDocument& xml);

/// Checks that links and joints form one tree with unique names. Throws std::runtime_error with file, line
/// and element otherwise: without a tree, no part of the model can be used.
void check_urdf_tree(const std::string& file, const tinyxml2::XMLDocument& xml);

/// Removes a `floating` joint at the root of a checked tree: if the root link is a point without mass (such
/// as `world`) and carries nothing else, its child becomes the root, because the root of a RobotModel is the
/// base, which floats or is held as the scene specifies.
void take_off_floating_root(tinyxml2::XMLDocument& xml);

/// Adds every element the reader cannot use to `findings` and removes it from `xml` (a geometry or an
/// inertial is deleted, a joint becomes a fixed one), so that urdfdom accepts the rest. Colours and the
/// controller extensions of <joint> are removed silently: nothing here uses them. `screen_urdf_links` returns
/// the surfaces of links that have a <contact>, by name: urdfdom does not know this element.
[[nodiscard]] std::map<std::string, Surface> screen_urdf_links(tinyxml2::XMLDocument& xml, MeshFiles& meshes,
                                                               UrdfFindings& findings);
void screen_urdf_joints(tinyxml2::XMLDocument& xml, UrdfFindings& findings);

}  // namespace walkman
