#pragma once

#include <string>
#include <vector>

namespace walkman {

/// Something in a URDF that cannot be used as written.
struct UrdfFinding {
  int line = 0;         ///< in the URDF, 1 = first
  std::string element;  ///< e.g. `joint "RElbj"`
  std::string reason;   ///< what was found and what was expected
};

/// `FILE:LINE: ELEMENT: REASON`.
[[nodiscard]] std::string to_sentence(const std::string& file, const UrdfFinding& finding);

/// Handles findings: collects them, or throws the first one as std::runtime_error.
class UrdfFindings {
 public:
  enum class OnFinding { kThrow, kCollect };

  UrdfFindings(std::string file, OnFinding on_finding);

  void add(int line, std::string element, std::string reason);
  [[nodiscard]] const std::vector<UrdfFinding>& all() const { return all_; }

 private:
  std::string file_;
  OnFinding on_finding_;
  std::vector<UrdfFinding> all_;
};

}  // namespace walkman
