#pragma once

#include <string>

#include <urdf_model/types.h>
#include <urdf_world/types.h>

namespace walkman {

/// Result of urdfdom's parser: the model, or what it logged if it returned none.
struct UrdfdomResult {
  urdf::ModelInterfaceSharedPtr model;
  std::string complaint;
};

/// Parses with urdfdom, whose messages go to a process-wide log handler; here they end up in `complaint` and
/// never on stderr. Calls from several threads are serialized.
[[nodiscard]] UrdfdomResult parse_with_urdfdom(const std::string& xml);

}  // namespace walkman
