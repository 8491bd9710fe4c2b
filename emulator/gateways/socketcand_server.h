#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "emulator/gateways/controller_pool.h"
#include "emulator/gateways/descriptor.h"
#include "emulator/gateways/socketcand_session.h"

namespace walkman::gateways {

struct SocketcandOptions {
  std::uint16_t port = 29536;          ///< TCP port; 0: any free one
  bool beacon = false;                 ///< announce the buses by UDP broadcasts, one every 3 s
  std::uint16_t beacon_port = 42'000;  ///< destination port of the broadcasts
};

/// A socketcand server: gives tools on this machine access to the emulated buses over TCP on 127.0.0.1,
/// without CAN support in the kernel; the protocol has no access control. Each client is one more computer on
/// the bus it opens.
///
/// It has no thread and never blocks: its owner calls `service` when `descriptor` is readable and `forward`
/// when the buses have moved. A client that reads too slowly loses frames, which are counted; one that sends
/// faster than the bus can carry is read at the bus's rate; one that opens no bus is disconnected; none
/// affects the others. Without clients it costs nothing.
class SocketcandServer {
 public:
  static constexpr std::size_t kMaxClients = 32;

  /// Starts listening. The buses must outlive the server. Throws std::runtime_error with the address and the
  /// reason.
  explicit SocketcandServer(std::span<bus::CanBus* const> buses, const SocketcandOptions& options = {});
  ~SocketcandServer();
  SocketcandServer(const SocketcandServer&) = delete;
  SocketcandServer& operator=(const SocketcandServer&) = delete;

  /// "127.0.0.1:29536".
  [[nodiscard]] std::string address() const;
  /// The port it listens on.
  [[nodiscard]] std::uint16_t port() const noexcept { return port_; }

  /// To wait on with poll or epoll; readable when there is something to do.
  [[nodiscard]] int descriptor() const noexcept { return epoll_.get(); }

  /// Accepts clients and takes what they have sent. Allocates only when a client connects or requests frames.
  void service() noexcept;

  /// Passes received frames to the clients, and frames of clients to buses that had no room for them before.
  void forward() noexcept;

  [[nodiscard]] std::size_t clients() const noexcept { return clients_.size(); }

  /// Totals over all clients since the start.
  [[nodiscard]] const SocketcandCounters& counters() const noexcept { return counters_; }

 private:
  struct Client;

  void accept_clients(Time wall) noexcept;
  void read(Client& client, Time wall) noexcept;
  void work_off(Client& client, Time wall) noexcept;
  void serve(Client& client, Time wall) noexcept;
  void write(Client& client) noexcept;
  void watch(Client& client) noexcept;
  void finish_round(Time wall) noexcept;
  void send_beacon() noexcept;
  [[nodiscard]] std::string beacon_text() const;

  ControllerPool pool_;
  SocketcandCounters counters_;
  std::uint16_t port_ = 0;
  Descriptor listener_;
  Descriptor timer_;
  Descriptor epoll_;
  Descriptor beacon_;
  std::uint16_t beacon_port_;
  Time timer_at_ = Time::max();  // setting of the timer, on the host's clock
  Time beacon_at_ = Time::max();
  std::vector<std::unique_ptr<Client>> clients_;
};

}  // namespace walkman::gateways
