#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "drivers/canopen/sdo_client.h"

namespace walkman::canopen {

/// One read or write of a node's configuration.
struct SdoStep {
  enum class Kind {
    kExpect,   ///< read; must equal `value`
    kNonZero,  ///< read; must not be 0
    kRead,     ///< read into `result`
    kWrite,    ///< write `value`
  };
  Kind kind = Kind::kExpect;
  ObjectAddress address;
  std::uint8_t size = 4;            ///< bytes of the object, 1, 2 or 4
  std::uint32_t value = 0;          ///< expected or to be written
  std::string meaning;              ///< human-readable, e.g. "rated torque, mN·m"
  std::uint32_t* result = nullptr;  ///< where the value read is stored; may be null
};

/// Runs a list of SDO steps over a client, one by one; a step without an answer is requested a second time.
class SdoSequence {
 public:
  explicit SdoSequence(std::vector<SdoStep> steps) : steps_(std::move(steps)) {}

  /// Returns to the first step.
  void restart(SdoClient& client) noexcept;

  /// Checks the client and starts the next transfer. Returns true once every step is done.
  /// Throws std::runtime_error with the object, the value found and the one expected.
  bool advance(SdoClient& client, Time now);

  [[nodiscard]] std::size_t size() const noexcept { return steps_.size(); }
  [[nodiscard]] std::size_t done() const noexcept { return next_; }

 private:
  void begin(SdoClient& client, Time now) const;
  void check(const SdoClient& client) const;

  std::vector<SdoStep> steps_;
  std::size_t next_ = 0;
  bool under_way_ = false;
  bool asked_twice_ = false;
};

/// "1018h:1".
[[nodiscard]] std::string to_string(ObjectAddress address);

/// "object does not exist (0602 0000h)".
[[nodiscard]] std::string to_string(SdoAbort code);

}  // namespace walkman::canopen
