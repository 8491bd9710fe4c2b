#include "apps/shared/frame_log.h"

namespace walkman::apps {

FrameLog::FrameLog(const std::filesystem::path& file, Emulator& emulator) : log_(bus::open_can_log(file)) {
  for (bus::CanBus* bus : emulator.buses()) {
    bus->set_observer([this, bus](const can::StampedFrame& f) { log_->write(bus->interface_name(), f); });
  }
}

}  // namespace walkman::apps
