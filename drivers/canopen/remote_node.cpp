#include "drivers/canopen/remote_node.h"

#include <stdexcept>

#include <fmt/format.h>

#include "drivers/canopen/objects.h"

namespace walkman::canopen {

RemoteNode::RemoteNode(NodeSettings settings, std::vector<SdoStep> configuration)
    : settings_(std::move(settings)),
      sdo_(settings_.node_id, kSdoTimeout),
      configuration_(std::move(configuration)) {}

std::string RemoteNode::label() const {
  return fmt::format("{} {} (node {} on {})", settings_.noun, settings_.name, settings_.node_id,
                     settings_.interface);
}

void RemoteNode::begin_boot(Time now) noexcept {
  stage_ = Stage::kAwaitingBootUp;
  boot_up_ = false;
  nmt_state_ = NmtState::kBootUp;
  heartbeat_at_ = now;
  sdo_.reset();
  clear_events();
  on_begin_boot();
}

bool RemoteNode::configure(Time now) {
  if (boot_up_) {
    boot_up_ = false;
    stage_ = Stage::kConfiguring;
    configuration_.restart(sdo_);
  }
  if (stage_ != Stage::kConfiguring) return stage_ == Stage::kConfigured;
  try {
    if (configuration_.advance(sdo_, now)) stage_ = Stage::kConfigured;
  } catch (const std::runtime_error& error) {
    throw std::runtime_error(label() + ": " + error.what());
  }
  return stage_ == Stage::kConfigured;
}

void RemoteNode::start(Time now) noexcept {
  stage_ = Stage::kStarted;
  heartbeat_at_ = now;
}

bool RemoteNode::receive(const can::StampedFrame& stamped, Time now) noexcept {
  const can::Frame& frame = stamped.frame;
  if (frame.extended || frame.remote || frame.fd) return false;
  switch (frame.id & 0x780U) {
    case 0x080: {
      const std::optional<Emergency> emergency = decode_emergency(frame);
      if (!emergency) return false;
      if (emergency->code != 0) {
        ++emergencies_;
        if (!emergency_) emergency_ = emergency;
      }
      return true;
    }
    case 0x180:
      return on_tpdo(1, stamped);
    case 0x280:
      return on_tpdo(2, stamped);
    case 0x380:
      return on_tpdo(3, stamped);
    case 0x480:
      return on_tpdo(4, stamped);
    case 0x580:
      if (frame.length != 8) return false;
      sdo_.receive(frame, now);
      return true;
    case 0x700:
      return on_error_control(stamped);
    default:
      return false;
  }
}

bool RemoteNode::on_error_control(const can::StampedFrame& stamped) noexcept {
  if (stamped.frame.length != 1) return false;
  const auto state = static_cast<NmtState>(stamped.frame.data[0] & 0x7FU);
  switch (state) {
    case NmtState::kBootUp:
      boot_up_ = true;
      if (stage_ == Stage::kStarted) stage_ = Stage::kLost;
      break;
    case NmtState::kStopped:
    case NmtState::kOperational:
    case NmtState::kPreOperational:
      break;
    default:
      return false;
  }
  nmt_state_ = state;
  heartbeat_at_ = std::max(heartbeat_at_, stamped.time);
  return true;
}

void RemoteNode::poll(Time now) noexcept { sdo_.poll(now); }

Time RemoteNode::heartbeat_age(Time now) const noexcept { return std::max(Time{0}, now - heartbeat_at_); }

void RemoteNode::clear_events() noexcept {
  emergency_.reset();
  request_failed_ = false;
}

void RemoteNode::latch_request_failure() noexcept {
  if (!request_failed_) {
    failed_address_ = sdo_.address();
    failed_code_ = sdo_.abort_code();
  }
  request_failed_ = true;
}

std::vector<SdoStep> identity_steps(std::uint32_t device_type) {
  using Kind = SdoStep::Kind;
  return {{Kind::kExpect, {object::kDeviceType, 0}, 4, device_type, "device type"},
          {Kind::kNonZero, {object::kIdentity, 1}, 4, 0, "vendor-ID"}};
}

SdoStep heartbeat_producer_step(const NodeSettings& settings) {
  return {SdoStep::Kind::kWrite,
          {object::kProducerHeartbeat, 0},
          2,
          milliseconds_of(settings.heartbeat_producer),
          "heartbeat producer time, ms"};
}

std::uint32_t milliseconds_of(Time time) {
  return static_cast<std::uint32_t>(std::chrono::ceil<std::chrono::milliseconds>(time).count());
}

}  // namespace walkman::canopen
