#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "emulator/gateways/descriptor.h"
#include "emulator/gateways/end_pool.h"
#include "emulator/gateways/socketcand_session.h"

namespace walkman::gateways {

struct SocketcandOptions {
  std::string address = "127.0.0.1";  ///< IPv4 address to listen on; the protocol knows no access control
  std::uint16_t port = 29536;         ///< 0: any free one
};

/// A socketcand server: gives tools on any machine access to the emulated buses over TCP, without CAN support
/// in the kernel. Each client is one more computer on the bus it opens.
///
/// It has no thread and never blocks: its owner calls `service` whenever `descriptor` is readable and after
/// every emulated cycle. A client that reads too slowly loses frames, which are counted; one that sends
/// faster than the bus carries is read no faster; neither is noticed by others.
class SocketcandServer {
 public:
  static constexpr std::size_t kMaxClients = 32;

  /// Listens. The buses must outlive the server. Throws std::runtime_error with the address and the reason.
  explicit SocketcandServer(std::span<bus::CanBus* const> buses, const SocketcandOptions& options = {});
  ~SocketcandServer();
  SocketcandServer(const SocketcandServer&) = delete;
  SocketcandServer& operator=(const SocketcandServer&) = delete;

  /// The port it listens on.
  [[nodiscard]] std::uint16_t port() const noexcept { return port_; }

  /// To wait on with poll or epoll; readable when there is something to do.
  [[nodiscard]] int descriptor() const noexcept { return epoll_.get(); }

  /// Accepts clients, passes their frames to the buses and received frames to them. Allocates only when a
  /// client comes.
  void service() noexcept;

  [[nodiscard]] std::size_t clients() const noexcept { return clients_.size(); }

  /// Over all clients since the start.
  [[nodiscard]] const SocketcandCounters& counters() const noexcept { return counters_; }

 private:
  struct Client;

  void accept_clients() noexcept;
  void read(Client& client, Time wall) noexcept;
  static void write(Client& client) noexcept;
  void watch(Client& client) noexcept;
  void set_timer() noexcept;

  EndPool pool_;
  SocketcandCounters counters_;
  std::uint16_t port_ = 0;
  Descriptor listener_;
  Descriptor timer_;  // the end of a handshake's pause
  Descriptor epoll_;
  std::vector<std::unique_ptr<Client>> clients_;
};

}  // namespace walkman::gateways
