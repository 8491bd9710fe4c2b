#include "emulator/logs/pcapng_log.h"

#include <algorithm>
#include <array>
#include <bit>

namespace walkman::bus {
namespace {

// Block and option types of the pcapng format (IETF draft-ietf-opsawg-pcapng).
constexpr std::uint32_t kSectionHeader = 0x0A0D0D0A;
constexpr std::uint32_t kInterfaceDescription = 1;
constexpr std::uint32_t kEnhancedPacket = 6;
constexpr std::uint32_t kByteOrderMagic = 0x1A2B3C4D;
constexpr std::uint16_t kEndOfOptions = 0;
constexpr std::uint16_t kCommentOption = 1;
constexpr std::uint16_t kInterfaceName = 2;
constexpr std::uint16_t kTimeResolution = 9;
constexpr std::uint8_t kNanoseconds = 9;  // 10^-9 s

// LINKTYPE_CAN_SOCKETCAN: identifier with flags, big-endian; length; FD flags; two reserved bytes; data.
constexpr std::uint16_t kLinkType = 227;
constexpr std::size_t kHeader = 8;
constexpr std::uint32_t kExtendedFlag = 0x80000000;
constexpr std::uint32_t kRemoteFlag = 0x40000000;
constexpr std::uint8_t kBitRateSwitch = 0x01;
constexpr std::uint8_t kFdFrame = 0x04;

static_assert(std::endian::native == std::endian::little, "blocks are written little-endian");

/// One block: type, length, body padded to 32 bits, length again.
class Block {
 public:
  explicit Block(std::uint32_t type) {
    append(type);
    append(std::uint32_t{0});
  }
  template <typename T>
  void append(T value) {
    bytes(&value, sizeof value);
  }
  void bytes(const void* from, std::size_t count) {
    const char* first = static_cast<const char*>(from);
    std::copy_n(first, count, data_.begin() + static_cast<std::ptrdiff_t>(size_));
    size_ += count;
  }
  void option(std::uint16_t code, const void* value, std::size_t size) {
    append(code);
    append(static_cast<std::uint16_t>(size));
    bytes(value, size);
    pad();
  }
  void pad() {
    while (size_ % 4 != 0) data_[size_++] = 0;
  }
  void write(std::ostream& out) {
    const auto length = static_cast<std::uint32_t>(size_ + 4);
    append(length);
    std::copy_n(std::bit_cast<std::array<char, 4>>(length).begin(), 4, data_.begin() + 4);
    out.write(data_.data(), static_cast<std::streamsize>(size_));
  }

 private:
  std::array<char, 512> data_;
  std::size_t size_ = 0;
};

std::uint32_t socket_can_id(const can::Frame& frame) {
  return frame.id | (frame.extended ? kExtendedFlag : 0U) | (frame.remote ? kRemoteFlag : 0U) |
         (frame.error ? kErrorFlag : 0U);
}

}  // namespace

PcapngLog::PcapngLog(std::filesystem::path file, std::string_view note) : CanLog(std::move(file)) {
  Block section(kSectionHeader);
  section.append(kByteOrderMagic);
  section.append(std::uint16_t{1});  // version 1.0
  section.append(std::uint16_t{0});
  section.append(std::int64_t{-1});  // length not given
  if (!note.empty()) {
    section.option(kCommentOption, note.data(), std::min(note.size(), kLongestNote));
    section.option(kEndOfOptions, nullptr, 0);
  }
  section.write(stream());
}

std::uint32_t PcapngLog::interface_number(std::string_view name) {
  const auto known = std::find(interfaces_.begin(), interfaces_.end(), name);
  const auto number = static_cast<std::uint32_t>(known - interfaces_.begin());
  if (known != interfaces_.end()) return number;
  interfaces_.emplace_back(name);
  Block block(kInterfaceDescription);
  block.append(kLinkType);
  block.append(std::uint16_t{0});
  block.append(std::uint32_t{0});  // frames are never truncated
  block.option(kInterfaceName, name.data(), std::min<std::size_t>(name.size(), 255));
  block.option(kTimeResolution, &kNanoseconds, 1);
  block.option(kEndOfOptions, nullptr, 0);
  block.write(stream());
  return number;
}

void PcapngLog::put(std::string_view interface_name, const can::StampedFrame& stamped) {
  const can::Frame& frame = stamped.frame;
  const std::uint32_t number = interface_number(interface_name);
  const auto time = static_cast<std::uint64_t>(stamped.time.count());
  const std::size_t data = frame.remote ? 0 : frame.length;
  const auto captured = static_cast<std::uint32_t>(kHeader + data);
  Block block(kEnhancedPacket);
  block.append(number);
  block.append(static_cast<std::uint32_t>(time >> 32U));
  block.append(static_cast<std::uint32_t>(time));
  block.append(captured);
  block.append(captured);
  const std::uint32_t id = socket_can_id(frame);
  for (int shift = 24; shift >= 0; shift -= 8) block.append(static_cast<std::uint8_t>(id >> shift));
  block.append(frame.length);
  block.append(static_cast<std::uint8_t>(frame.fd ? kFdFrame | kBitRateSwitch : 0U));
  block.append(std::uint16_t{0});
  block.bytes(frame.data.data(), data);
  block.pad();
  block.write(stream());
}

}  // namespace walkman::bus
