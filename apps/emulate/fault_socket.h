#pragma once

#include <filesystem>

#include "apps/emulate/emulation.h"
#include "emulator/gateways/descriptor.h"
#include "emulator/gateways/owned_path.h"

namespace walkman::apps {

/// Default path on which `walkman-hil fault` reaches an emulation: in XDG_RUNTIME_DIR, else in /tmp.
[[nodiscard]] std::filesystem::path default_fault_socket();

/// Takes faults while an emulation runs, from programs of the same user, over a local datagram socket. A
/// request is a word and its arguments, one per line: inject, with the words of `faults::parse_fault`; clear,
/// with names or all; active. The answer is ok or error, followed by one or more lines.
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

/// Faults are only for emulated buses: anything else on a wire could be somebody's robot. Asks the kernel
/// (rtnetlink) what kind the interfaces of `emulation` are, and throws std::runtime_error for one that is
/// neither vcan nor vxcan, and if the kernel does not tell.
void require_virtual(const Emulation& emulation);

/// Sends a request and waits for its answer. Throws EnvironmentError if nobody answers, and
/// std::runtime_error with the reason if the emulation rejects it.
[[nodiscard]] std::string ask_emulator(const std::filesystem::path& path,
                                       const std::vector<std::string>& request);

}  // namespace walkman::apps
