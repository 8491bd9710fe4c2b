#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "drivers/camera/cloud_message.h"
#include "emulator/camera/multisense.h"
#include "emulator/gateways/descriptor.h"
#include "emulator/gateways/owned_path.h"

namespace walkman::gateways {

/// Serves the camera's clouds on a local stream socket (drivers/camera/cloud_message.h), to programs of the
/// same user.
///
/// Runs in a thread of its own, because casting a cloud takes longer than a control cycle: the emulator's
/// loop only publishes what the camera saw, and when. What is answered depends on what was published last, on
/// nothing else.
///
/// No client delays another by more than the casting of one cloud: nothing blocks, and a client is read only
/// when the answer before has left. One that takes nothing of an answer for `kSendLimit` is hung up on. When
/// there are `kMaxClients`, a new one takes the place of the one that was silent for longest, of those that
/// never asked for a cloud first.
class CloudServer {
 public:
  static constexpr std::size_t kMaxClients = 32;
  static constexpr Time kSendLimit = std::chrono::seconds(10);

  /// Listens at once on `path`, which only this user may connect to. A socket there whose server is gone and
  /// which belongs to this user is replaced; anything else is left alone. `camera` must outlive the server
  /// and is used for rendering by it alone. Throws std::runtime_error with the path.
  CloudServer(const std::string& path, MultiSense& camera);
  /// Ends the thread and removes the socket, if it still is the one that was made.
  ~CloudServer();
  CloudServer(const CloudServer&) = delete;
  CloudServer& operator=(const CloudServer&) = delete;

  /// The camera's time is `now`, its newest exposure the one it has noted. Cheap unless there is a new one.
  void publish(Time now);

  /// Clouds answered with.
  [[nodiscard]] std::uint64_t served() const noexcept { return served_; }

 private:
  struct Client;
  struct Published {
    Time now{};
    Exposure exposure;
  };

  void listen(const std::string& path);
  void work();
  [[nodiscard]] int wait_ms(Time wall) const;
  void accept_clients(Time wall);
  void make_room();
  void read(Client& client, Time wall);
  void answer(Client& client, Time age);
  void write(Client& client, Time wall);
  void watch(Client& client);

  MultiSense& camera_;
  Descriptor listener_;
  OwnedPath file_;
  Descriptor stop_;  // becomes readable when the server is to end
  Descriptor epoll_;
  std::vector<std::unique_ptr<Client>> clients_;
  std::shared_ptr<camera::OrganizedCloud> cloud_;  // the last that was cast; clients may still be reading it

  std::mutex mutex_;  // of `published_`
  Published published_;
  std::atomic<std::uint64_t> served_ = 0;
  std::thread thread_;
};

}  // namespace walkman::gateways
