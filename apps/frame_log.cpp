#include "apps/frame_log.h"

#include <stdexcept>

namespace walkman::apps {
namespace {

const std::filesystem::path& checked(const std::filesystem::path& file) {
  if (file.extension() == ".log") return file;
  throw std::runtime_error(file.string() + ": a CAN log's name ends in .log");
}

}  // namespace

FrameLog::FrameLog(const std::filesystem::path& file, Emulator& emulator) : log_(checked(file)) {
  for (bus::CanBus* bus : emulator.buses()) {
    bus->set_observer([this, bus](const can::StampedFrame& f) { log_.write(bus->interface_name(), f); });
  }
}

}  // namespace walkman::apps
