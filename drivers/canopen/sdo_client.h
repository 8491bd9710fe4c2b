#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "drivers/can/frame.h"
#include "drivers/canopen/sdo.h"
#include "drivers/time.h"

namespace walkman::canopen {

/// Client end of one SDO channel (CiA 301, 7.2.4): expedited and segmented transfers, one at a time.
///
/// A state machine without socket or clock: responses and time are passed in, and at most one request waits
/// in `pending` to be sent. Neither allocates nor throws.
class SdoClient {
 public:
  enum class State {
    kIdle,   ///< no transfer since construction or `reset`
    kBusy,   ///< a transfer is under way
    kDone,   ///< it has ended; `data` is the result of an upload
    kFailed  ///< refused, aborted or timed out: `abort_code`
  };

  /// Longest object a transfer can carry, bytes.
  static constexpr std::size_t kCapacity = 256;

  /// `server`: node-ID 1..127. `timeout`: longest wait for each response.
  SdoClient(std::uint8_t server, Time timeout) noexcept : server_(server), timeout_(timeout) {}

  /// Starts reading an object. A transfer under way is abandoned.
  void upload(ObjectAddress address, Time now) noexcept;

  /// Starts writing an object: expedited up to 4 bytes, segmented above. Fails at once for more than
  /// `kCapacity` bytes, or none.
  void download(ObjectAddress address, std::span<const std::uint8_t> bytes, Time now) noexcept;

  /// Returns to idle; sends nothing.
  void reset() noexcept;

  /// Takes a frame with the server's response COB-ID. Frames that are not 8 bytes, and answers to another
  /// object (late ones of an abandoned transfer), are ignored.
  void receive(const can::Frame& frame, Time now) noexcept;

  /// Fails the transfer when its response is overdue, and leaves the abort message in `pending`.
  void poll(Time now) noexcept;

  /// The frame to send next, or null. Call `sent` once the interface has taken it.
  [[nodiscard]] const can::Frame* pending() const noexcept { return has_pending_ ? &pending_ : nullptr; }
  void sent() noexcept { has_pending_ = false; }

  [[nodiscard]] State state() const noexcept { return state_; }
  /// Whether a request has been sent that the server has not answered yet.
  [[nodiscard]] bool awaiting() const noexcept { return state_ == State::kBusy && !has_pending_; }
  [[nodiscard]] ObjectAddress address() const noexcept { return address_; }
  [[nodiscard]] Time timeout() const noexcept { return timeout_; }
  /// When the newest request was put into `pending`.
  [[nodiscard]] Time asked_at() const noexcept { return asked_at_; }

  /// Data read by an upload; valid in state kDone.
  [[nodiscard]] std::span<const std::uint8_t> data() const noexcept { return {buffer_.data(), size_}; }

  /// Why the transfer failed; valid in state kFailed.
  [[nodiscard]] SdoAbort abort_code() const noexcept { return abort_code_; }
  [[nodiscard]] bool aborted_by_server() const noexcept { return aborted_by_server_; }

 private:
  enum class Awaiting { kUploadStart, kUploadSegment, kDownloadStart, kDownloadSegment };

  void begin(ObjectAddress address, Awaiting awaiting, Time now) noexcept;
  void request(std::uint8_t command, Time now) noexcept;
  void abort(SdoAbort code) noexcept;
  void on_upload_start(const can::Frame& frame, Time now) noexcept;
  void on_upload_segment(const can::Frame& frame, Time now) noexcept;
  void on_download(const can::Frame& frame, Time now) noexcept;
  void send_segment(Time now) noexcept;

  std::uint8_t server_;
  Time timeout_;
  State state_ = State::kIdle;
  Awaiting awaiting_ = Awaiting::kUploadStart;
  ObjectAddress address_;
  Time asked_at_{};
  bool toggle_ = false;
  bool announced_ = false;       ///< the server gave the size of a segmented upload
  std::size_t expected_ = 0;     ///< that size
  std::size_t size_ = 0;         ///< bytes in the buffer
  std::size_t transferred_ = 0;  ///< bytes of a segmented download already sent
  std::array<std::uint8_t, kCapacity> buffer_{};
  can::Frame pending_;
  bool has_pending_ = false;
  SdoAbort abort_code_{};
  bool aborted_by_server_ = false;
};

}  // namespace walkman::canopen
