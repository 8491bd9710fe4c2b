#pragma once

#include <functional>
#include <string>
#include <vector>

#include "drivers/camera/cloud_message.h"
#include "drivers/camera/range_camera.h"

namespace walkman::camera {

/// The range camera behind a local stream socket (cloud_message.h).
class SocketCamera final : public RangeCamera {
 public:
  /// Whether `latest` waits for the answer or lets it come in over the next calls.
  enum class Waiting { kBlock, kPoll };

  /// `now` is the caller's clock, the one `latest` and the clouds' stamps are on. Waits up to two seconds for
  /// the server's hello. Throws std::runtime_error with the path when there is no server, or it is none.
  SocketCamera(std::string path, std::function<Time()> now);
  ~SocketCamera() override;
  SocketCamera(const SocketCamera&) = delete;
  SocketCamera& operator=(const SocketCamera&) = delete;

  [[nodiscard]] const Hello& hello() const { return hello_; }
  void set_waiting(Waiting waiting) { waiting_ = waiting; }

  /// Throws std::runtime_error with the path when the connection broke, the server sent something else, or,
  /// when blocking, did not answer for half a minute.
  [[nodiscard]] bool latest(Time not_before, OrganizedCloud& out) override;

 private:
  void connect();
  void send_request(Time not_before);
  /// Reads what is there, up to the end of one message; true when it is complete.
  [[nodiscard]] bool read_some();
  [[nodiscard]] bool wait_readable(Time limit) const;
  [[nodiscard]] std::size_t message_bytes() const;
  [[nodiscard]] std::span<const std::uint8_t> payload() const;
  [[noreturn]] void fail(const std::string& what) const;

  std::string path_;
  std::function<Time()> now_;
  Waiting waiting_ = Waiting::kBlock;
  int socket_ = -1;
  Hello hello_;
  bool asked_ = false;
  Time asked_at_{};
  MessageHeader header_;
  std::vector<std::uint8_t> buffer_;  // header and payload of the message that is coming in
  std::size_t filled_ = 0;
  OrganizedCloud cloud_;                // the next one's memory
  std::vector<Eigen::Vector3f> spare_;  // and that of the one after it, if the caller has none to give back
};

}  // namespace walkman::camera
