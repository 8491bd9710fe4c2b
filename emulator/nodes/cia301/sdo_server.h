#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "drivers/can/frame.h"
#include "drivers/time.h"
#include "emulator/nodes/cia301/object_dictionary.h"
#include "emulator/nodes/cia301/outbox.h"

namespace walkman::nodes {

/// SDO server (CiA 301, 7.2.4): expedited, segmented and block transfer in both directions, one at a time. A
/// transfer whose client stays silent for a second is aborted with 0504 0000.
///
/// A new request for an expedited, segmented or block transfer ends the one under way silently, except while
/// the segments of a block download arrive, when every frame is a segment or an abort.
class SdoServer {
 public:
  static constexpr Time kTimeout = std::chrono::seconds(1);
  /// Number of segments that the server requests in a block.
  static constexpr std::uint8_t kBlockSize = 127;

  /// `node_id` must outlive the server and may change while no transfer is under way.
  SdoServer(ObjectDictionary& dictionary, Outbox& outbox, const std::uint8_t& node_id);

  /// Takes a frame with the server's request identifier. Ignores lengths other than 8 bytes.
  void receive(const can::Frame& frame, Time now) noexcept;
  void advance(Time now) noexcept;
  [[nodiscard]] Time next_event() const noexcept { return deadline_; }
  /// Discards a transfer under way.
  void reset() noexcept;

  /// Refuses every request for an object with this code from now on, or no longer. Allocates.
  void refuse(std::uint16_t index, SdoAbort code) { refused_.push_back({index, code}); }
  void stop_refusing(std::uint16_t index);

  /// Whether segments of a block upload wait for the outbox, which gets one at a time: `feed` adds the next.
  [[nodiscard]] bool feeding() const noexcept { return transfer_ == Transfer::kBlockUpload; }
  void feed() noexcept;

 private:
  enum class Transfer {
    kNone,
    kDownload,
    kUpload,
    kBlockDownload,     // segments are arriving
    kBlockDownloadEnd,  // all segments have arrived
    kBlockUploadStart,  // waits for the client's start
    kBlockUpload,       // segments are being sent, or their acknowledgement is awaited
    kBlockUploadEnd,    // waits for the client's end
  };
  using Request = std::span<const std::uint8_t, 8>;

  // Expedited and segmented transfer
  void start_download(Request request, Time now) noexcept;
  void download_segment(Request request, Time now) noexcept;
  void start_upload(Request request, Time now) noexcept;
  void answer_upload(Time now) noexcept;
  void upload_segment(Request request, Time now) noexcept;

  // Block download
  void block_download(Request request, Time now) noexcept;
  void start_block_download(Request request, Time now) noexcept;
  void block_download_segment(Request request, Time now) noexcept;
  void end_block_download(Request request) noexcept;

  // Block upload
  void block_upload(Request request, Time now) noexcept;
  void start_block_upload(Request request, Time now) noexcept;
  void block_upload_acknowledged(Request request, Time now) noexcept;
  [[nodiscard]] std::size_t segment_count() const noexcept;

  /// Finds the request's object; aborts and returns false if there is none, or if its requests are refused.
  [[nodiscard]] bool find_object(Request request) noexcept;
  [[nodiscard]] bool open_for_writing(Request request) noexcept;
  [[nodiscard]] bool open_for_reading(Request request) noexcept;
  [[nodiscard]] Refusal check_announced() const noexcept;
  void unexpected() noexcept;
  void abort(ObjectAddress address, SdoAbort code) noexcept;
  void abort_transfer(SdoAbort code) noexcept;
  void respond(std::uint8_t command, std::span<const std::uint8_t> rest) noexcept;
  void respond_address(std::uint8_t command, ObjectAddress address) noexcept;

  ObjectDictionary& dictionary_;
  Outbox& outbox_;
  const std::uint8_t& node_id_;

  struct RefusedObject {
    std::uint16_t index = 0;
    SdoAbort code{};
  };
  std::vector<RefusedObject> refused_;

  Transfer transfer_ = Transfer::kNone;
  Time deadline_ = Time::max();
  ObjectAddress address_;
  Entry* entry_ = nullptr;
  bool toggle_ = false;
  bool crc_wanted_ = false;

  // Download. The buffer has room for the unused bytes of the last segments of a block.
  std::array<std::uint8_t, ObjectDictionary::kLongestString + 14> buffer_{};
  std::size_t size_ = 0;         // bytes received
  bool size_announced_ = false;  // by the client
  std::size_t announced_ = 0;
  bool complete_ = false;  // the block download's last segment has arrived

  // Upload.
  std::span<const std::uint8_t> value_;
  std::size_t position_ = 0;  // bytes sent

  // Blocks.
  std::uint8_t sequence_ = 0;     // last correct segment of the block under way
  std::uint8_t block_size_ = 0;   // of an upload
  std::size_t acknowledged_ = 0;  // segments of an upload
};

}  // namespace walkman::nodes
