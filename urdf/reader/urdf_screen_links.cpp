#include <array>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <Eigen/Core>
#include <fmt/format.h>
#include <tinyxml2.h>

#include "urdf/reader/inertia_check.h"
#include "urdf/reader/mesh_file.h"
#include "urdf/reader/urdf_finding.h"
#include "urdf/reader/urdf_screen.h"
#include "urdf/reader/xml_numbers.h"

namespace walkman {
namespace {

using tinyxml2::XMLElement;
using Problem = std::optional<std::string>;

Problem check_origin(const XMLElement& parent) {
  const XMLElement* origin = parent.FirstChildElement("origin");
  if (origin == nullptr) return std::nullopt;
  std::array<double, 3> values{};
  if (auto wrong = read_attribute(*origin, "xyz", values, false)) return wrong;
  return read_attribute(*origin, "rpy", values, false);
}

Problem check_inertial(const XMLElement& inertial) {
  if (auto wrong = check_origin(inertial)) return wrong;
  const XMLElement* mass = inertial.FirstChildElement("mass");
  const XMLElement* inertia = inertial.FirstChildElement("inertia");
  if (mass == nullptr || inertia == nullptr)
    return fmt::format("there is no <{}>", mass == nullptr ? "mass" : "inertia");
  std::array<double, 1> m{};
  if (auto wrong = read_attribute(*mass, "value", m, true)) return wrong;
  std::array<double, 6> I{};
  constexpr std::array<const char*, 6> kNames = {"ixx", "ixy", "ixz", "iyy", "iyz", "izz"};
  for (std::size_t i = 0; i < kNames.size(); ++i)
    if (auto wrong = read_attribute(*inertia, kNames[i], std::span(I).subspan(i, 1), true)) return wrong;
  Eigen::Matrix3d tensor;
  tensor << I[0], I[1], I[2], I[1], I[3], I[4], I[2], I[4], I[5];
  return inertia_problem(m[0], tensor);
}

Problem check_positive(const XMLElement& shape, const char* attribute, std::span<double> values) {
  if (auto wrong = read_attribute(shape, attribute, values, true)) return wrong;
  for (const double value : values)
    if (value <= 0)
      return fmt::format("<{}> {}: \"{}\", expected more than 0", shape.Name(), attribute,
                         shape.Attribute(attribute));
  return std::nullopt;
}

Problem check_mesh(const XMLElement& mesh, MeshFiles& meshes) {
  const char* uri = mesh.Attribute("filename");
  if (uri == nullptr || *uri == '\0') return "<mesh> has no filename";
  std::array<double, 3> scale = {1, 1, 1};
  if (auto wrong = read_attribute(mesh, "scale", scale, false)) return wrong;
  if (scale[0] * scale[1] * scale[2] == 0)
    return fmt::format("<mesh> scale: \"{}\" has a 0", mesh.Attribute("scale"));
  try {
    (void)meshes.load(uri, {scale[0], scale[1], scale[2]});
  } catch (const std::runtime_error& error) {
    return error.what();
  }
  return std::nullopt;
}

Problem check_geometry(const XMLElement& holder, MeshFiles& meshes) {
  if (auto wrong = check_origin(holder)) return wrong;
  const XMLElement* geometry = holder.FirstChildElement("geometry");
  const XMLElement* shape = geometry == nullptr ? nullptr : geometry->FirstChildElement();
  if (shape == nullptr) return "there is no shape in it";
  const std::string_view kind = shape->Name();
  std::array<double, 3> size{};
  if (kind == "box") return check_positive(*shape, "size", size);
  if (kind == "mesh") return check_mesh(*shape, meshes);
  if (kind != "sphere" && kind != "cylinder")
    return fmt::format("<{}> is not supported, expected box, cylinder, sphere or mesh", kind);
  if (auto wrong = check_positive(*shape, "radius", std::span(size).first(1))) return wrong;
  if (kind == "sphere") return std::nullopt;
  return check_positive(*shape, "length", std::span(size).first(1));
}

void screen_geometries(XMLElement& link, const char* kind, MeshFiles& meshes, UrdfFindings& findings) {
  int number = 0;
  for (XMLElement* e = link.FirstChildElement(kind); e != nullptr;) {
    XMLElement* next = e->NextSiblingElement(kind);
    ++number;
    while (XMLElement* material = e->FirstChildElement("material")) e->DeleteChild(material);
    if (auto wrong = check_geometry(*e, meshes)) {
      findings.add(e->GetLineNum(), fmt::format("link \"{}\", {} {}", link.Attribute("name"), kind, number),
                   *wrong);
      link.DeleteChild(e);
    }
    e = next;
  }
}

/// Reads the value of one element of a <contact>, if there is one.
Problem read_contact(const XMLElement& contact, const char* name, double& value) {
  const XMLElement* element = contact.FirstChildElement(name);
  if (element == nullptr) return std::nullopt;
  std::array<double, 1> read{};
  if (auto wrong = read_attribute(*element, "value", read, true)) return wrong;
  if (read[0] < 0)
    return fmt::format("<{}> value: \"{}\", expected 0 or more", name, element->Attribute("value"));
  value = read[0];
  return std::nullopt;
}

Problem read_surface(const XMLElement& contact, Surface& surface) {
  for (const auto& [name, value] : {std::pair<const char*, double*>{"lateral_friction", &surface.friction},
                                    {"rolling_friction", &surface.rolling_friction},
                                    {"spinning_friction", &surface.spinning_friction},
                                    {"restitution", &surface.restitution},
                                    {"stiffness", &surface.stiffness},
                                    {"damping", &surface.damping}}) {
    if (auto wrong = read_contact(contact, name, *value)) return wrong;
  }
  if (surface.restitution > 1)
    return fmt::format("<restitution> {:g}, expected at most 1", surface.restitution);
  return std::nullopt;
}

}  // namespace

std::map<std::string, Surface> screen_urdf_links(tinyxml2::XMLDocument& xml, MeshFiles& meshes,
                                                 UrdfFindings& findings) {
  std::map<std::string, Surface> surfaces;
  XMLElement* robot = xml.RootElement();
  for (XMLElement* material = robot->FirstChildElement("material"); material != nullptr;) {
    XMLElement* next = material->NextSiblingElement("material");
    robot->DeleteChild(material);
    material = next;
  }
  for (XMLElement* link = robot->FirstChildElement("link"); link != nullptr;
       link = link->NextSiblingElement("link")) {
    XMLElement* inertial = link->FirstChildElement("inertial");
    if (inertial != nullptr) {
      if (auto wrong = check_inertial(*inertial)) {
        findings.add(inertial->GetLineNum(), fmt::format("link \"{}\", inertial", link->Attribute("name")),
                     *wrong);
        link->DeleteChild(inertial);
      }
    }
    screen_geometries(*link, "collision", meshes, findings);
    screen_geometries(*link, "visual", meshes, findings);
    const XMLElement* contact = link->FirstChildElement("contact");
    if (contact == nullptr) continue;
    Surface surface;
    if (auto wrong = read_surface(*contact, surface)) {
      findings.add(contact->GetLineNum(), fmt::format("link \"{}\", contact", link->Attribute("name")),
                   *wrong);
    } else {
      surfaces[link->Attribute("name")] = surface;
    }
  }
  return surfaces;
}

}  // namespace walkman
