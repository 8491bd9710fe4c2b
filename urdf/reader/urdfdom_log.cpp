#include "urdf/reader/urdfdom_log.h"

#include <mutex>

#include <console_bridge/console.h>
#include <urdf_parser/urdf_parser.h>

namespace walkman {
namespace {

class FirstComplaint : public console_bridge::OutputHandler {
 public:
  FirstComplaint() { console_bridge::useOutputHandler(this); }
  ~FirstComplaint() override { console_bridge::restorePreviousOutputHandler(); }
  FirstComplaint(const FirstComplaint&) = delete;
  FirstComplaint& operator=(const FirstComplaint&) = delete;

  void log(const std::string& text, console_bridge::LogLevel level, const char* /*file*/,
           int /*line*/) override {
    if (level >= console_bridge::CONSOLE_BRIDGE_LOG_ERROR && text_.empty()) text_ = text;
  }
  [[nodiscard]] const std::string& text() const { return text_; }

 private:
  std::string text_;
};

}  // namespace

UrdfdomResult parse_with_urdfdom(const std::string& xml) {
  static std::mutex one_at_a_time;
  const std::lock_guard lock(one_at_a_time);
  const FirstComplaint complaint;
  UrdfdomResult result;
  result.model = urdf::parseURDF(xml);
  if (!result.model) result.complaint = complaint.text().empty() ? "no reason given" : complaint.text();
  return result;
}

}  // namespace walkman
