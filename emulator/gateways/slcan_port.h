#pragma once

#include <filesystem>
#include <string>

#include "emulator/gateways/descriptor.h"
#include "emulator/gateways/owned_path.h"
#include "emulator/gateways/slcan_adapter.h"

namespace walkman::gateways {

/// A serial port that acts as a CAN adapter (slcan) on an emulated bus: a pseudo-terminal, which tools open
/// by name as they would open /dev/ttyUSB0. They may close it and others may open it again; the adapter is
/// then as after power-up.
///
/// It has no thread and never blocks: its owner calls `service` when `descriptor` is readable and `forward`
/// when the bus has moved. Without a peer it costs nothing.
class SlcanPort {
 public:
  /// `link`, unless empty, becomes a symbolic link to the pseudo-terminal until the port is destroyed. A link
  /// of this user that an emulator left behind, to a pseudo-terminal that no longer exists, is replaced;
  /// anything else at that path is left alone. The bus must outlive the port. Throws std::runtime_error with
  /// the file and the reason.
  explicit SlcanPort(bus::CanBus& bus, const std::filesystem::path& link = {});
  ~SlcanPort() = default;
  SlcanPort(const SlcanPort&) = delete;
  SlcanPort& operator=(const SlcanPort&) = delete;

  /// Name of the pseudo-terminal, "/dev/pts/7".
  [[nodiscard]] const std::string& terminal() const noexcept { return terminal_; }

  /// To wait on with poll or epoll; readable when there is something to do.
  [[nodiscard]] int descriptor() const noexcept { return epoll_.get(); }

  /// Takes the peer's commands and passes received frames to it. Allocates only when it is first opened.
  void service() noexcept;

  /// Passes received frames to the peer.
  void forward() noexcept;

  [[nodiscard]] const SlcanCounters& counters() const noexcept { return adapter_.counters(); }

 private:
  void place_link(const bus::CanBus& bus, const std::filesystem::path& link);
  void read() noexcept;
  void write() noexcept;
  void watch() noexcept;
  void hung_up() noexcept;

  SlcanAdapter adapter_;
  OwnedPath link_;
  std::string terminal_;
  Descriptor master_;
  Descriptor epoll_;
  std::uint32_t watched_ = 0;
  bool attached_ = false;  // a peer has written since the last hang-up
};

}  // namespace walkman::gateways
