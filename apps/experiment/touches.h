#pragma once

#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "emulator/plant/plant.h"
#include "urdf/reader/robot_description.h"

namespace walkman::apps {

/// A contact that the robot should not have had, when it first occurred.
struct UnwantedTouch {
  std::string link, other;  ///< a link of the robot; another link, or a body of the scene
  std::string phase;
  double time = 0;   ///< s
  double force = 0;  ///< along the contact's normal at that time, N
};

/// Monitors the robot's contacts, by the plant's ground truth.
///
/// The feet may stand on the ground, and a hand may touch itself and the object. While the hand closes, lifts
/// and lowers, its fingers may slide along the surface on which the object lies: that is how a soft hand
/// grasps a low object. All other contacts are recorded, each pair once.
class TouchWatch {
 public:
  /// `object`: name of the object to be grasped.
  TouchWatch(const KnownRobot& robot, std::string object);

  /// Sets another object to be grasped.
  void grasps(std::string object) { object_ = std::move(object); }

  void look(const plant::Plant& plant, std::string_view phase);
  [[nodiscard]] const std::vector<UnwantedTouch>& touches() const { return touches_; }

 private:
  enum class Part { kNone, kBody, kFoot, kPalm, kFinger };
  struct NamedPart {
    std::string link;
    Part part = Part::kNone;
    int side = -1;  // which hand
  };
  [[nodiscard]] const NamedPart& part_of(std::string_view name) const;
  [[nodiscard]] bool allowed(const NamedPart& part, std::string_view other, std::string_view phase) const;

  std::string object_;
  std::vector<NamedPart> parts_;  // by link, sorted
  NamedPart none_;
  std::vector<UnwantedTouch> touches_;
};

/// "RForearm touched the table with 12 N at 29.61 s, in approach".
[[nodiscard]] std::string to_string(const UnwantedTouch& touch);

}  // namespace walkman::apps
