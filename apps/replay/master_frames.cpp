#include "apps/replay/master_frames.h"

#include "drivers/canopen/cob_id.h"

namespace walkman::apps {
namespace {

constexpr std::uint32_t kLssMaster = 0x7E5;
constexpr std::uint8_t kMasterNode = 127;

}  // namespace

bool is_from_master(const can::Frame& frame) noexcept {
  namespace cob_id = canopen::cob_id;
  if (frame.extended || frame.error) return false;
  if (frame.remote) return true;
  switch (frame.id & 0x780U) {
    case 0x200:
    case 0x300:
    case 0x400:
    case 0x500:
    case 0x600:
      return (frame.id & 0x7FU) != 0;
    default:
      return frame.id == cob_id::kNmt || frame.id == cob_id::kSync || frame.id == cob_id::kTime ||
             frame.id == cob_id::error_control(kMasterNode) || frame.id == kLssMaster;
  }
}

}  // namespace walkman::apps
