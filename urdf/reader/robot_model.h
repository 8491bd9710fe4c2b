#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include <Eigen/Geometry>

namespace walkman {

struct BoxShape {
  Eigen::Vector3d size;  ///< full edge lengths, m
};
struct CylinderShape {
  double radius;  ///< m
  double length;  ///< m, along the shape's z axis
};
struct SphereShape {
  double radius;  ///< m
};
struct MeshShape {
  std::filesystem::path file;              ///< resolved path
  std::vector<Eigen::Vector3d> vertices;   ///< m, scale already applied
  std::vector<Eigen::Vector3i> triangles;  ///< vertex indices, counter-clockwise seen from outside
};

/// A geometric primitive or mesh fixed to a link.
struct LinkGeometry {
  Eigen::Isometry3d X_LG = Eigen::Isometry3d::Identity();  ///< pose of the geometry in the link frame
  std::variant<BoxShape, CylinderShape, SphereShape, MeshShape> shape;
  std::string name;
};

/// Contact properties of a link's surface: URDF's <contact>, an extension read by Bullet's importer
/// (<lateral_friction>, <rolling_friction>, <spinning_friction>, <restitution>, <stiffness>, <damping>, each
/// with a `value`), and its defaults.
struct Surface {
  double friction = 0.5;         ///< Coulomb coefficient
  double rolling_friction = 0;   ///< lever arm of the normal force against rolling, m
  double spinning_friction = 0;  ///< the same against turning about the normal, m
  double restitution = 0;        ///< share of the approach speed that is returned
  double stiffness = 0;          ///< of each contact point, N/m; 0: rigid
  double damping = 0;            ///< goes with the stiffness, N·s/m
};

struct Link {
  std::string name;
  double mass = 0;                                     ///< kg
  Eigen::Vector3d p_LLcm = Eigen::Vector3d::Zero();    ///< centre of mass in the link frame, m
  Eigen::Matrix3d I_LLcm_L = Eigen::Matrix3d::Zero();  ///< inertia about the CoM, link axes, kg·m²
  std::vector<LinkGeometry> collisions;
  std::vector<LinkGeometry> visuals;  ///< the collisions if the URDF gives none
  Surface surface;
  int parent_joint = -1;  ///< index of the joint that carries it; −1 = root
};

struct JointLimits {
  double lower = 0;     ///< rad or m
  double upper = 0;     ///< rad or m
  double velocity = 0;  ///< rad/s or m/s
  double effort = 0;    ///< N·m or N
};

struct Mimic {
  std::string joint;
  double multiplier = 1;
  double offset = 0;
};

enum class JointType { kFixed, kRevolute, kContinuous, kPrismatic };

struct Joint {
  std::string name;
  JointType type = JointType::kFixed;
  int parent_link = -1;
  int child_link = -1;
  Eigen::Isometry3d X_PJ = Eigen::Isometry3d::Identity();  ///< joint frame in the parent link frame at zero
  Eigen::Vector3d axis = Eigen::Vector3d::UnitX();         ///< unit vector in the joint frame
  JointLimits limits;
  double damping = 0;   ///< N·m·s/rad
  double friction = 0;  ///< N·m, Coulomb
  std::optional<Mimic> mimic;
};

/// A kinematic tree read from a URDF. Links and joints are in depth-first order: a parent always comes before
/// its children, and siblings keep the file's order.
class RobotModel {
 public:
  std::string name;
  std::filesystem::path file;
  std::vector<Link> links;
  std::vector<Joint> joints;

  /// Index of a link or joint. Throws std::out_of_range with a sentence that names the model and the
  /// requested name.
  [[nodiscard]] int link_index(const std::string& link_name) const;
  [[nodiscard]] int joint_index(const std::string& joint_name) const;
  [[nodiscard]] std::optional<int> find_link(const std::string& link_name) const;
  [[nodiscard]] std::optional<int> find_joint(const std::string& joint_name) const;

  [[nodiscard]] double total_mass() const;  ///< kg

 private:
  friend class UrdfReader;
  std::map<std::string, int, std::less<>> link_by_name_;
  std::map<std::string, int, std::less<>> joint_by_name_;
};

/// Where `package://NAME/rest` is looked up: each entry is a folder that contains a folder NAME.
using PackagePath = std::vector<std::filesystem::path>;

/// Reads a URDF with urdfdom, meshes (STL, OBJ, DAE) with assimp.
///
/// Throws std::runtime_error (one sentence) with file, element, the value found and what was expected. For a
/// missing mesh, it names every path tried.
[[nodiscard]] RobotModel load_robot_model(const std::filesystem::path& urdf_file,
                                          const PackagePath& packages = {});

/// Joint values (rad) of one `group_state` of an SRDF. Throws std::runtime_error naming file and element if
/// the state is missing, or one of its joints is not in `model`.
[[nodiscard]] std::map<std::string, double> load_posture(const std::filesystem::path& srdf_file,
                                                         const std::string& state, const RobotModel& model);

/// Names of the links in each `disable_collisions` of an SRDF: pairs that touch on an intact robot, or that
/// cannot touch. Throws std::runtime_error naming file and element if a link is not in `model`.
[[nodiscard]] std::vector<std::pair<std::string, std::string>> load_disabled_collisions(
    const std::filesystem::path& srdf_file, const RobotModel& model);

}  // namespace walkman
