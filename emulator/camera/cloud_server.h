#pragma once

#include <atomic>
#include <filesystem>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "drivers/camera/cloud_message.h"
#include "emulator/camera/multisense.h"

namespace walkman {

/// Serves the camera's clouds on a local stream socket (drivers/camera/cloud_message.h).
///
/// Runs in a thread of its own, because casting a cloud takes longer than a control cycle: the emulator's
/// loop only publishes what the camera saw, and when. What is answered depends on what was published last, on
/// nothing else.
class CloudServer {
 public:
  struct Settings {
    std::string path;
    Time period{};
    camera::Pacing pacing = camera::Pacing::kRealTime;
  };

  /// Listens at once; a socket file that nobody serves is replaced. `camera` must outlive the server and is
  /// used for rendering by it alone. Throws std::runtime_error with the path.
  CloudServer(const Settings& settings, MultiSense& camera);
  /// Ends the thread and removes the file.
  ~CloudServer();
  CloudServer(const CloudServer&) = delete;
  CloudServer& operator=(const CloudServer&) = delete;

  /// The camera's time is `now`, its newest exposure the one it has noted. Cheap unless there is a new one.
  void publish(Time now);

  /// Clouds sent.
  [[nodiscard]] std::uint64_t served() const noexcept { return served_; }

 private:
  struct Client {
    int socket;
    std::vector<std::uint8_t> received;
  };

  void listen();
  void work();
  void accept_client();
  [[nodiscard]] bool serve(Client& client);
  [[nodiscard]] std::vector<std::uint8_t> answer(Time age);
  [[nodiscard]] bool send_all(int socket, const std::vector<std::uint8_t>& bytes) const;

  Settings settings_;
  MultiSense& camera_;
  int listener_ = -1;
  int stop_ = -1;  // becomes readable when the server is to end
  std::vector<Client> clients_;
  camera::OrganizedCloud cloud_;

  std::mutex mutex_;  // of the two below
  Time now_{};
  Exposure exposure_;
  std::uint64_t published_frame_ = 0;
  std::atomic<std::uint64_t> served_ = 0;
  std::thread thread_;
};

}  // namespace walkman
