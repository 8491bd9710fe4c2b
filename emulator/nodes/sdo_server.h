#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "drivers/can/frame.h"
#include "emulator/nodes/object_dictionary.h"
#include "emulator/nodes/outbox.h"

namespace walkman::nodes {

/// SDO server (CiA 301, 7.2.4): expedited and segmented transfer in both directions. Block transfer is
/// refused with 0504 0001. A segmented transfer without a segment for a second is given up with 0504 0000.
class SdoServer {
 public:
  static constexpr Time kTimeout = std::chrono::seconds(1);
  static constexpr std::size_t kMaxBytes = 256;

  SdoServer(ObjectDictionary& dictionary, Outbox& outbox, std::uint8_t node_id);

  /// A frame with the server's request identifier. Other lengths than 8 bytes are ignored.
  void receive(const can::Frame& frame, Time now) noexcept;
  void advance(Time now) noexcept;
  [[nodiscard]] Time next_event() const noexcept { return deadline_; }
  /// Forgets a transfer under way.
  void reset() noexcept;

 private:
  enum class Transfer { kNone, kDownload, kUpload };
  using Request = std::span<const std::uint8_t, 8>;

  void start_download(Request request, Time now) noexcept;
  void download_segment(Request request, Time now) noexcept;
  void start_upload(Request request, Time now) noexcept;
  void upload_segment(Request request, Time now) noexcept;
  void abort(ObjectAddress address, SdoAbort code) noexcept;
  void abort_transfer(SdoAbort code) noexcept;
  void respond(std::uint8_t command, std::span<const std::uint8_t> rest) noexcept;
  void respond_address(std::uint8_t command, ObjectAddress address) noexcept;

  ObjectDictionary& dictionary_;
  Outbox& outbox_;
  std::uint8_t node_id_;

  Transfer transfer_ = Transfer::kNone;
  ObjectAddress address_;
  Entry* entry_ = nullptr;
  bool toggle_ = false;
  std::array<std::uint8_t, kMaxBytes> buffer_{};
  std::size_t size_ = 0;       // of the whole value; while downloading, bytes received
  std::size_t position_ = 0;   // bytes sent
  std::size_t announced_ = 0;  // size the client gave, 0 if none
  Time deadline_ = Time::max();
};

}  // namespace walkman::nodes
