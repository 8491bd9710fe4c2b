#pragma once

#include <filesystem>

#include "apps/emulate/emulation.h"
#include "emulator/gateways/descriptor.h"
#include "emulator/gateways/owned_path.h"

namespace walkman::apps {

/// Where `walkman-hil fault` speaks with an emulation without being told: in XDG_RUNTIME_DIR, else in /tmp.
[[nodiscard]] std::filesystem::path default_fault_socket();

/// Takes faults while an emulation runs, from programs of the same user: a local datagram socket. A request
/// is a word and its arguments, a line each: inject, with the words of `faults::parse_fault`; clear, with
/// names or all; active. The answer is ok or error, and behind it a line or more.
class FaultSocket {
 public:
  /// Opens the socket and attaches it to `emulation`, which must outlive it. Throws EnvironmentError.
  FaultSocket(Emulation& emulation, const std::filesystem::path& path);

 private:
  void service();
  [[nodiscard]] std::string answer(const std::vector<std::string>& request);

  Emulation& emulation_;
  gateways::Descriptor socket_;
  gateways::OwnedPath path_;
};

/// Faults are for emulated buses: what else is on a wire could be somebody's robot. Asks the kernel
/// (rtnetlink) what the interfaces of `emulation` are, and throws std::runtime_error for one that is no vcan
/// or vxcan, and when the kernel does not tell.
void require_virtual(const Emulation& emulation);

/// Sends a request and waits for its answer. Throws EnvironmentError when nobody answers, and
/// std::runtime_error with what the emulation has against it.
[[nodiscard]] std::string ask_emulator(const std::filesystem::path& path,
                                       const std::vector<std::string>& request);

}  // namespace walkman::apps
