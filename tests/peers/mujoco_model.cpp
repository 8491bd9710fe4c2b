#include "tests/peers/mujoco_model.h"

#include <array>
#include <cstring>
#include <stdexcept>

#include <fmt/format.h>

namespace walkman::peers {
namespace {

std::string vector_text(const Eigen::Vector3d& v) { return fmt::format("{} {} {}", v.x(), v.y(), v.z()); }

std::string pose_text(const Eigen::Isometry3d& X) {
  const Eigen::Quaterniond q(X.linear());
  return fmt::format("pos=\"{}\" quat=\"{} {} {} {}\"", vector_text(X.translation()), q.w(), q.x(), q.y(),
                     q.z());
}

struct GeomText {
  std::string operator()(const BoxShape& box) const {
    return fmt::format("type=\"box\" size=\"{}\"", vector_text(box.size / 2));
  }
  std::string operator()(const CylinderShape& c) const {
    return fmt::format("type=\"cylinder\" size=\"{} {}\"", c.radius, c.length / 2);
  }
  std::string operator()(const SphereShape& s) const {
    return fmt::format("type=\"sphere\" size=\"{}\"", s.radius);
  }
  std::string operator()(const MeshShape& /*mesh*/) const {
    throw std::runtime_error("MJCF of a model with meshes: not supported, expected primitives");
  }
};

class Writer {
 public:
  Writer(const RobotModel& model, const plant::RigidTree& tree, const MjcfOptions& options)
      : model_(model), tree_(tree), options_(options), children_(model.links.size()) {
    for (std::size_t i = 0; i < model.links.size(); ++i) {
      const int joint = model.links[i].parent_joint;
      if (joint < 0) continue;
      const Joint& parent_joint = model.joints[static_cast<std::size_t>(joint)];
      children_[static_cast<std::size_t>(parent_joint.parent_link)].push_back(i);
    }
  }

  [[nodiscard]] std::string text() {
    const Eigen::Isometry3d X_RM = tree_.groups().front().X_RM;
    out_ = fmt::format(
        "<mujoco><compiler angle=\"radian\" inertiafromgeom=\"false\"/>"
        "<option timestep=\"{}\" gravity=\"0 0 {}\" integrator=\"Euler\"/>"
        "<worldbody>",
        options_.step, -options_.gravity);
    if (options_.ground) {
      out_ += fmt::format(
          "<geom type=\"plane\" size=\"5 5 1\" contype=\"2\" conaffinity=\"1\" condim=\"3\" friction=\"{} 0 "
          "0\"/>",
          options_.friction);
    }
    out_ += fmt::format("<body name=\"free_base\" {}>", pose_text(options_.X_WR * X_RM));
    if (!options_.fixed_base) out_ += "<freejoint name=\"free_base\"/>";
    // MuJoCo requires mass in a body that moves by itself: the first of the base group's links that has any
    // lends its own.
    for (const int i : tree_.groups().front().links) {
      if (carrier_ < 0 && model_.links[static_cast<std::size_t>(i)].mass > 0) carrier_ = i;
    }
    if (carrier_ >= 0) inertial(model_.links[static_cast<std::size_t>(carrier_)], tree_.X_ML(carrier_));
    link(0, X_RM.inverse());
    out_ += "</body></worldbody><sensor>";
    for (const MjcfSensor& sensor : options_.sensors) {
      out_ += fmt::format(
          "<force name=\"{0}_force\" site=\"{0}_site\"/><torque name=\"{0}_torque\" site=\"{0}_site\"/>",
          sensor.name);
    }
    return out_ + "</sensor></mujoco>";
  }

 private:
  /// Inertia of `link`, whose pose in the current body is X_BL.
  void inertial(const Link& link, const Eigen::Isometry3d& X_BL) {
    const Eigen::Matrix3d I = X_BL.linear() * link.I_LLcm_L * X_BL.linear().transpose();
    out_ += fmt::format("<inertial pos=\"{}\" mass=\"{}\" fullinertia=\"{} {} {} {} {} {}\"/>",
                        vector_text(X_BL * link.p_LLcm), link.mass, I(0, 0), I(1, 1), I(2, 2), I(0, 1),
                        I(0, 2), I(1, 2));
  }

  void link(std::size_t i, const Eigen::Isometry3d& X_PL) {
    const Link& link = model_.links[i];
    out_ += fmt::format("<body name=\"{}\" {}>", link.name, pose_text(X_PL));
    const int group_index = tree_.group_of(static_cast<int>(i));
    const plant::RigidBodyGroup& group = tree_.groups()[static_cast<std::size_t>(group_index)];
    const bool first_of_group = group.root_link == static_cast<int>(i);
    if (first_of_group && group.moves) {
      const Joint& joint = model_.joints[static_cast<std::size_t>(group.joint)];
      out_ += fmt::format("<joint name=\"{}\" type=\"{}\" axis=\"{}\" limited=\"false\"/>", joint.name,
                          joint.type == JointType::kPrismatic ? "slide" : "hinge", vector_text(joint.axis));
    }
    if (link.mass > 0 && static_cast<int>(i) != carrier_) inertial(link, Eigen::Isometry3d::Identity());
    if (options_.ground) {
      for (const LinkGeometry& geometry : link.collisions) {
        out_ +=
            fmt::format("<geom {} {} contype=\"1\" conaffinity=\"2\" condim=\"3\" friction=\"{} 0 0\"/>",
                        std::visit(GeomText{}, geometry.shape), pose_text(geometry.X_LG), options_.friction);
      }
    }
    for (const MjcfSensor& sensor : options_.sensors) {
      if (!first_of_group || sensor.group != group_index) continue;
      out_ += fmt::format("<site name=\"{}_site\" {}/>", sensor.name,
                          pose_text(group.X_RM * tree_.X_ML(sensor.link)));
    }
    for (const std::size_t child : children_[i]) {
      const Joint& joint = model_.joints[static_cast<std::size_t>(model_.links[child].parent_joint)];
      this->link(child, joint.X_PJ);
    }
    out_ += "</body>";
  }

  const RobotModel& model_;
  const plant::RigidTree& tree_;
  const MjcfOptions& options_;
  std::vector<std::vector<std::size_t>> children_;
  int carrier_ = -1;  // link whose inertia is in the base's body
  std::string out_;
};

int address(const mjModel& model, mjtObj type, const std::string& name, const int* addresses) {
  const int id = mj_name2id(&model, type, name.c_str());
  if (id < 0) throw std::out_of_range("MuJoCo's model has no " + name);
  return addresses[id];
}

}  // namespace

std::string mjcf(const RobotModel& model, const plant::RigidTree& tree, const MjcfOptions& options) {
  return Writer(model, tree, options).text();
}

MujocoWorld::MujocoWorld(const std::string& mjcf_text) {
  constexpr const char* kFile = "robot.xml";
  const auto files = std::make_unique<mjVFS>();
  mj_defaultVFS(files.get());
  mj_makeEmptyFileVFS(files.get(), kFile, static_cast<int>(mjcf_text.size()));
  std::memcpy(files->filedata[mj_findFileVFS(files.get(), kFile)], mjcf_text.data(), mjcf_text.size());
  std::array<char, 1000> error{};
  model.reset(mj_loadXML(kFile, files.get(), error.data(), static_cast<int>(error.size())));
  mj_deleteVFS(files.get());
  if (!model) throw std::runtime_error(std::string("MuJoCo: ") + error.data());
  data.reset(mj_makeData(model.get()));
}

int MujocoWorld::position_address(const std::string& joint) const {
  return address(*model, mjOBJ_JOINT, joint, model->jnt_qposadr);
}

int MujocoWorld::velocity_address(const std::string& joint) const {
  return address(*model, mjOBJ_JOINT, joint, model->jnt_dofadr);
}

int MujocoWorld::sensor_address(const std::string& sensor) const {
  return address(*model, mjOBJ_SENSOR, sensor, model->sensor_adr);
}

}  // namespace walkman::peers
