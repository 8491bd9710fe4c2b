#pragma once

#include <array>
#include <cstddef>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "urdf/reader/yaml_map.h"

namespace walkman {

/// Quantities in which a robot differs from its model; `kErrorKinds` gives the name and unit of each.
enum class ErrorKind {
  kLinkMass,
  kChainMass,
  kHandMass,
  kLinkCom,
  kInertia,
  kGravity,
  kJointZero,
  kJointOrigin,
  kJointTilt,
  kSpring,
  kFriction,
  kTorqueZero,
  kGearError,
  kHandOrigin,
  kHandRotation,
  kCameraOrigin,
  kCameraRotation,
  kImuRotation,
  kForceTorqueOrigin,
  kForceTorqueRotation,
  kAxialForceGain,
  kLateralForceGain,
  kTorqueGain,
  kCrossTalk,
  kForcePerTorque,
  kTorquePerForce,
  kPadFriction,
};

struct ErrorKindName {
  const char* key;   ///< in files
  const char* unit;  ///< "" for a share
  double most;       ///< largest spread that makes sense, in the unit
};

/// Indexed by `ErrorKind`. Each is explained in `model_error.yaml`.
inline constexpr std::array kErrorKinds = {
    ErrorKindName{"link_mass", "", 0.5},
    ErrorKindName{"chain_mass", "", 0.5},
    ErrorKindName{"hand_mass_kg", "kg", 5},
    ErrorKindName{"link_com_m", "m", 0.1},
    ErrorKindName{"inertia", "", 2},
    ErrorKindName{"gravity_m_per_s2", "m/s²", 1},
    ErrorKindName{"joint_zero_rad", "rad", 0.5},
    ErrorKindName{"joint_origin_m", "m", 0.1},
    ErrorKindName{"joint_tilt_rad", "rad", 0.5},
    ErrorKindName{"spring", "", 1},
    ErrorKindName{"friction", "", 2},
    ErrorKindName{"torque_zero", "", 0.5},
    ErrorKindName{"gear_error_rad", "rad", 0.01},
    ErrorKindName{"hand_origin_m", "m", 0.1},
    ErrorKindName{"hand_rotation_rad", "rad", 0.5},
    ErrorKindName{"camera_origin_m", "m", 0.2},
    ErrorKindName{"camera_rotation_rad", "rad", 0.5},
    ErrorKindName{"imu_rotation_rad", "rad", 0.5},
    ErrorKindName{"force_torque_origin_m", "m", 0.1},
    ErrorKindName{"force_torque_rotation_rad", "rad", 0.5},
    ErrorKindName{"axial_force_gain", "", 0.5},
    ErrorKindName{"lateral_force_gain", "", 0.5},
    ErrorKindName{"torque_gain", "", 0.5},
    ErrorKindName{"cross_talk", "", 0.5},
    ErrorKindName{"force_per_torque_per_m", "N/(N·m)", 20},
    ErrorKindName{"torque_per_force_m", "m", 0.1},
    ErrorKindName{"pad_friction", "", 1},
};
static_assert(kErrorKinds.size() == static_cast<std::size_t>(ErrorKind::kPadFriction) + 1);

[[nodiscard]] constexpr const ErrorKindName& name_of(ErrorKind kind) {
  return kErrorKinds[static_cast<std::size_t>(kind)];
}

/// Distribution of one quantity: normal with `sigma`, and outliers whose size is uniform in `least` ..
/// `most`, of either sign or in any direction.
struct Spread {
  double sigma = 0;
  double least = 0, most = 0;  ///< both 0: no outliers

  [[nodiscard]] bool any() const { return sigma > 0 || most > 0; }
};

/// The links at and below `below` weigh `mass`, kg; the excess over the model is put into `carried_by`.
struct WeighedPart {
  std::string below, carried_by;
  double mass = 0;
};

/// Model error that a scene selects: the name of a level, and individual spreads that differ from the
/// level's.
struct ModelErrorChoice {
  /// An override. Without `outliers`, the level's outliers scale with sigma.
  struct Override {
    double sigma = 0;
    std::optional<std::array<double, 2>> outliers;
  };
  std::string level = "none";
  std::map<ErrorKind, Override> changed;
  std::optional<bool> weighed_parts;  ///< unset: as in the level

  [[nodiscard]] std::string text() const;  ///< e.g. "calibrated, but joint_zero_rad 0"
};

/// All levels, "none" first.
[[nodiscard]] const std::vector<std::string>& model_error_levels();

/// Reads a scene's `model_error`: a level, or a mapping of `base` (a level), `weighed_parts` and spreads,
/// each a sigma or {sigma, outliers: [least, most]}. Throws std::runtime_error naming file, line and key.
[[nodiscard]] ModelErrorChoice read_model_error(const YamlMap& scene);

/// Spreads of all quantities, from which robots are drawn.
struct ModelError {
  double outlier_share = 0;
  std::array<Spread, kErrorKinds.size()> spreads;
  std::vector<WeighedPart> weighed_parts;  ///< empty: masses are the model's

  [[nodiscard]] const Spread& of(ErrorKind kind) const { return spreads[static_cast<std::size_t>(kind)]; }
  [[nodiscard]] bool any() const;
};

/// Returns the model error that `choice` selects from the levels in `file` (`model_error.yaml`). Throws
/// std::runtime_error naming file, line and key.
[[nodiscard]] ModelError load_model_error(const std::filesystem::path& file, const ModelErrorChoice& choice);

}  // namespace walkman
