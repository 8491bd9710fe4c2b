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

/// Parses the text of a URDF. Throws std::runtime_error with file and line when it is not well-formed XML
/// with a named <robot>, or still a xacro.
void parse_urdf_xml(const std::string& file, const std::string& text, tinyxml2::XMLDocument& xml);

/// Checks that links and joints form one tree with unique names. Throws std::runtime_error with file, line
/// and element otherwise: without a tree nothing of the model can be used.
void check_urdf_tree(const std::string& file, const tinyxml2::XMLDocument& xml);

/// Takes a `floating` joint at the root off a tree that has been checked: where the root link is a point
/// without mass (`world`, say) and carries nothing else, its child becomes the root, for the root of a
/// RobotModel is the base and floats, or is held, as the scene says.
void take_off_floating_root(tinyxml2::XMLDocument& xml);

/// Puts every element the reader cannot use into `findings` and takes it out of `xml` (a geometry or an
/// inertial is removed, a joint becomes a fixed one), so that urdfdom accepts the rest. Colours and the
/// controller extensions of <joint> are taken out silently: nothing here uses them. That of links returns the
/// surfaces of those that have a <contact>, by name: urdfdom does not know it.
[[nodiscard]] std::map<std::string, Surface> screen_urdf_links(tinyxml2::XMLDocument& xml, MeshFiles& meshes,
                                                               UrdfFindings& findings);
void screen_urdf_joints(tinyxml2::XMLDocument& xml, UrdfFindings& findings);

}  // namespace walkman
