#include "drivers/canopen/master.h"

#include <algorithm>

#include "drivers/canopen/cob_id.h"
#include "drivers/canopen/node_settings.h"
#include "drivers/canopen/remote_node.h"

namespace walkman::canopen {
namespace {

// A flood must not keep the control cycle from ending; the rest is taken in the next call.
constexpr int kMaxFramesPerCall = 4096;

// A node sends at most its four TPDOs per SYNC, an SDO response, a heartbeat, and occasional emergencies;
// anything beyond that is from a babbling node.
constexpr int kFramesPerSync = 8;

bool only_a_master_sends(const can::Frame& frame) {
  const std::uint32_t function = frame.id & 0x780U;
  return !frame.extended &&
         (frame.id == cob_id::kNmt || frame.id == cob_id::kSync ||
          frame.id == cob_id::error_control(kMasterNodeId) || function == 0x200 || function == 0x300 ||
          function == 0x400 || function == 0x500 || function == 0x600);
}

}  // namespace

void Master::add(RemoteNode& node) noexcept { nodes_[node.node_id() & 0x7FU] = &node; }

void Master::receive(Time now) noexcept {
  can::StampedFrame stamped;
  for (int i = 0; i < kMaxFramesPerCall && interface_->receive(stamped); ++i) {
    ++counters_.received;
    if (stamped.frame.error) {
      ++counters_.reports;
      continue;
    }
    RemoteNode* node = stamped.frame.id <= 0x7FF ? nodes_[stamped.frame.id & 0x7FU] : nullptr;
    if (node != nullptr && node->receive(stamped, now)) {
      if (node->frames_since_sync() > kFramesPerSync) traffic_.add_foreign(stamped.frame);
      continue;
    }
    ++counters_.ignored;
    traffic_.add_foreign(stamped.frame);
    if (only_a_master_sends(stamped.frame)) note_foreign(stamped.frame.id);
  }
}

void Master::note_foreign(std::uint32_t id) noexcept {
  ++counters_.foreign;
  const auto known = foreign_ids();
  if (foreign_count_ == kForeignIds || std::find(known.begin(), known.end(), id) != known.end()) return;
  foreign_[foreign_count_++] = id;
}

void Master::discard() noexcept {
  can::StampedFrame stamped;
  for (int i = 0; i < kMaxFramesPerCall && interface_->receive(stamped); ++i) ++counters_.received;
  traffic_.forget();
}

bool Master::send(const can::Frame& frame) noexcept {
  const can::SendResult result = interface_->send(frame);
  if (result == can::SendResult::kQueued) return true;
  ++counters_.not_sent;
  refused_full_ = refused_full_ || result == can::SendResult::kQueueFull;
  refused_invalid_ = refused_invalid_ || result == can::SendResult::kInvalid;
  refused_down_ = refused_down_ || result == can::SendResult::kInterfaceDown;
  return false;
}

bool Master::nmt(NmtCommand command, std::uint8_t node) noexcept {
  return send(can::Frame(cob_id::kNmt, {static_cast<std::uint8_t>(command), node}));
}

bool Master::sync() noexcept {
  can::Frame frame(cob_id::kSync, {});
  if (sync_overflow_ != 0) {
    frame.length = 1;
    frame.data[0] = static_cast<std::uint8_t>(sync_counter_ >= sync_overflow_ ? 1 : sync_counter_ + 1);
  }
  if (!send(frame)) return false;
  sync_counter_ = frame.data[0];
  for (RemoteNode* node : nodes_) {
    if (node != nullptr) node->sync_sent();
  }
  return true;
}

void Master::heartbeat(Time now) noexcept {
  if (heartbeat_sent_ != Time::min() && now - heartbeat_sent_ < heartbeat_period_) return;
  const auto state = static_cast<std::uint8_t>(NmtState::kOperational);
  if (send(can::Frame(cob_id::error_control(kMasterNodeId), {state}))) heartbeat_sent_ = now;
}

void Master::send_requests() noexcept {
  for (RemoteNode* node : nodes_) {
    if (node == nullptr || node->sdo().pending() == nullptr) continue;
    if (!send(*node->sdo().pending())) return;
    node->request_sent();
  }
}

void Master::end_cycle(Time now) noexcept {
  interface_->flush();
  traffic_.end_cycle(now);
  full_cycles_ = refused_full_ ? full_cycles_ + 1 : 0;
  link_ = interface_->link();
  // In bus-off, frames are refused, too, and bus-off is the more precise state.
  if (refused_down_ && link_ != can::LinkState::kBusOff) link_ = can::LinkState::kDown;
  invalid_ = refused_invalid_;
  refused_full_ = refused_down_ = refused_invalid_ = false;
}

}  // namespace walkman::canopen
