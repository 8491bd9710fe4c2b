#include "urdf/reader/urdf_reader.h"

#include <algorithm>
#include <cstddef>
#include <stdexcept>
#include <utility>

#include <fmt/format.h>

#include "urdf/reader/text_file.h"
#include "urdf/reader/urdf_screen.h"
#include "urdf/reader/urdfdom_log.h"
#include "urdf/reader/utf8.h"

namespace walkman {
namespace {

constexpr std::size_t kMaxUrdfBytes = 50'000'000;

Eigen::Vector3d to_eigen(const urdf::Vector3& v) { return {v.x, v.y, v.z}; }

Eigen::Isometry3d to_eigen(const urdf::Pose& pose) {
  Eigen::Isometry3d X = Eigen::Isometry3d::Identity();
  X.translation() = to_eigen(pose.position);
  X.linear() = Eigen::Quaterniond(pose.rotation.w, pose.rotation.x, pose.rotation.y, pose.rotation.z)
                   .normalized()
                   .toRotationMatrix();
  return X;
}

void add_inertial(const urdf::Inertial& inertial, Link& link) {
  const Eigen::Isometry3d X_LC = to_eigen(inertial.origin);
  Eigen::Matrix3d I_C;
  I_C << inertial.ixx, inertial.ixy, inertial.ixz, inertial.ixy, inertial.iyy, inertial.iyz, inertial.ixz,
      inertial.iyz, inertial.izz;
  link.mass = inertial.mass;
  link.p_LLcm = X_LC.translation();
  link.I_LLcm_L = X_LC.linear() * I_C * X_LC.linear().transpose();
}

LinkGeometry to_geometry(const urdf::Geometry& geometry, const urdf::Pose& origin, const std::string& name,
                         MeshFiles& meshes) {
  LinkGeometry result;
  result.X_LG = to_eigen(origin);
  result.name = name;
  switch (geometry.type) {
    case urdf::Geometry::BOX:
      result.shape = BoxShape{to_eigen(static_cast<const urdf::Box&>(geometry).dim)};
      break;
    case urdf::Geometry::CYLINDER: {
      const auto& cylinder = static_cast<const urdf::Cylinder&>(geometry);
      result.shape = CylinderShape{cylinder.radius, cylinder.length};
      break;
    }
    case urdf::Geometry::SPHERE:
      result.shape = SphereShape{static_cast<const urdf::Sphere&>(geometry).radius};
      break;
    case urdf::Geometry::MESH: {
      const auto& mesh = static_cast<const urdf::Mesh&>(geometry);
      result.shape = meshes.load(mesh.filename, to_eigen(mesh.scale));
      break;
    }
  }
  return result;
}

JointType to_type(const urdf::Joint& joint) {
  switch (joint.type) {
    case urdf::Joint::REVOLUTE:
      return JointType::kRevolute;
    case urdf::Joint::CONTINUOUS:
      return JointType::kContinuous;
    case urdf::Joint::PRISMATIC:
      return JointType::kPrismatic;
    default:
      return JointType::kFixed;
  }
}

Joint to_joint(const urdf::Joint& source) {
  Joint joint;
  joint.name = source.name;
  joint.type = to_type(source);
  joint.X_PJ = to_eigen(source.parent_to_joint_origin_transform);
  if (joint.type != JointType::kFixed) joint.axis = to_eigen(source.axis).normalized();
  if (source.limits)
    joint.limits = {source.limits->lower, source.limits->upper, source.limits->velocity,
                    source.limits->effort};
  if (source.dynamics) {
    joint.damping = source.dynamics->damping;
    joint.friction = source.dynamics->friction;
  }
  if (source.mimic)
    joint.mimic = Mimic{source.mimic->joint_name, source.mimic->multiplier, source.mimic->offset};
  return joint;
}

}  // namespace

UrdfReader::UrdfReader(std::filesystem::path urdf_file, PackagePath packages,
                       UrdfFindings::OnFinding on_finding)
    : file_(std::move(urdf_file)),
      meshes_(file_, std::move(packages)),
      findings_(file_.string(), on_finding) {}

RobotModel UrdfReader::read() {
  parse_urdf_xml(file_.string(), read_text_file(file_, kMaxUrdfBytes), xml_);
  check_urdf_tree(file_.string(), xml_);
  take_off_floating_root(xml_);
  surfaces_ = screen_urdf_links(xml_, meshes_, findings_);
  screen_urdf_joints(xml_, findings_);
  for (const auto* joint = xml_.RootElement()->FirstChildElement("joint"); joint != nullptr;
       joint = joint->NextSiblingElement("joint"))
    joint_order_[joint->Attribute("name")] = static_cast<int>(joint_order_.size());

  tinyxml2::XMLPrinter printer(nullptr, true);
  xml_.Print(&printer);
  const UrdfdomResult parsed = parse_with_urdfdom(printer.CStr());
  if (!parsed.model)
    throw std::runtime_error(
        one_line(fmt::format("{}: urdfdom does not accept it: {}", file_.string(), parsed.complaint)));

  model_ = RobotModel{};
  model_.name = parsed.model->getName();
  model_.file = file_;
  add_subtree(*parsed.model, *parsed.model->getRoot(), -1);
  return std::move(model_);
}

void UrdfReader::add_link(const urdf::Link& source, int parent_joint) {
  Link link;
  link.name = source.name;
  link.parent_joint = parent_joint;
  if (source.inertial) add_inertial(*source.inertial, link);
  for (const auto& collision : source.collision_array)
    link.collisions.push_back(to_geometry(*collision->geometry, collision->origin, collision->name, meshes_));
  for (const auto& visual : source.visual_array)
    link.visuals.push_back(to_geometry(*visual->geometry, visual->origin, visual->name, meshes_));
  if (link.visuals.empty()) link.visuals = link.collisions;
  if (const auto surface = surfaces_.find(link.name); surface != surfaces_.end())
    link.surface = surface->second;
  model_.link_by_name_[link.name] = static_cast<int>(model_.links.size());
  model_.links.push_back(std::move(link));
}

void UrdfReader::add_subtree(const urdf::ModelInterface& tree, const urdf::Link& link, int parent_joint) {
  const int link_index = static_cast<int>(model_.links.size());
  add_link(link, parent_joint);
  // urdfdom keeps joints by name; the file's order is restored here.
  auto joints = link.child_joints;
  std::sort(joints.begin(), joints.end(), [this](const auto& a, const auto& b) {
    return joint_order_.at(a->name) < joint_order_.at(b->name);
  });
  for (const auto& source : joints) {
    Joint joint = to_joint(*source);
    joint.parent_link = link_index;
    joint.child_link = static_cast<int>(model_.links.size());
    const int joint_index = static_cast<int>(model_.joints.size());
    model_.joint_by_name_[joint.name] = joint_index;
    model_.joints.push_back(std::move(joint));
    add_subtree(tree, *tree.getLink(source->child_link_name), joint_index);
  }
}

RobotModel load_robot_model(const std::filesystem::path& urdf_file, const PackagePath& packages) {
  return UrdfReader(urdf_file, packages, UrdfFindings::OnFinding::kThrow).read();
}

}  // namespace walkman
