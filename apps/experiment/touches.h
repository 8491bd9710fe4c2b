#pragma once

#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "emulator/plant/plant.h"
#include "urdf/reader/robot_description.h"

namespace walkman::apps {

/// Something that the robot has touched and should not have, when it first did.
struct UnwantedTouch {
  std::string link, other;  ///< a link of the robot; another, or a body of the scene
  std::string phase;
  double time = 0;   ///< s
  double force = 0;  ///< along the contact's normal then, N
};

/// Watches what the robot touches, by the plant's truth.
///
/// The feet stand on the ground, a hand may touch itself and the object. While it closes, lifts and lowers,
/// its fingers may slide along what the object lies on: that is how a soft hand takes what lies low. All else
/// is noted, each pair once.
class TouchWatch {
 public:
  /// `object` is the name of what is to be grasped.
  TouchWatch(const KnownRobot& robot, std::string object);

  /// Another is to be grasped.
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
