#pragma once

#include <vector>

#include "emulator/nodes/cia301/canopen_slave.h"

namespace walkman::nodes {

/// A generic device, node-ID 5, serial number 12345678h.
///
/// 2000h u32, written by RPDO1 (type 255) and RPDO2 (type 1); 2001h u32, sent by TPDO1 (type 1); 2002h u16,
/// a parameter from 10 to 20; 2010h:1-16 u32, mappable. TPDO2 to 4 and RPDO3 to 4 are off and empty.
class TestSlave : public CanopenSlave {
 public:
  explicit TestSlave(std::uint8_t node_id = 5)
      : CanopenSlave({node_id, 0x00020194, "RShLat drive", 0x77, 0x12345678}) {
    objects().add(variable(0x2000, read_write<std::uint32_t>("Command").pdo()));
    objects().add(variable(0x2001, read_only<std::uint32_t>("Value", 0x11223344).pdo()));
    objects().add(variable(0x2002, read_write<std::uint16_t>("Parameter", 15).within(10, 20)));
    objects().add(array_of(0x2010, "Wide", read_write<std::uint32_t>("Wide {}").pdo(), 16));
    command = objects().object<std::uint32_t>(0x2000);
    value = objects().object<std::uint32_t>(0x2001);
    parameter = objects().object<std::uint16_t>(0x2002);
    for (std::uint8_t sub = 1; sub <= 16; ++sub) {
      wide.push_back(objects().object<std::uint32_t>(0x2010, sub).factory(0x01010101U * sub));
    }
    const std::vector<std::uint32_t> to_command{mapped(0x2000, 0, 32)};
    PdoSet receive;
    receive[0] = {true, 255, 0, to_command};
    receive[1] = {true, 1, 0, to_command};
    PdoSet transmit;
    transmit[0] = {true, 1, 0, {mapped(0x2001, 0, 32)}};
    configure_pdos(receive, transmit);
  }
  void changed() { signal_change(value.entry()); }

  Object<std::uint32_t> command, value;
  Object<std::uint16_t> parameter;
  std::vector<Object<std::uint32_t>> wide;
  std::vector<std::uint16_t> losses;  ///< error codes of on_connection_lost
  int resets = 0;

 protected:
  void on_connection_lost(std::uint16_t code) noexcept override { losses.push_back(code); }
  void on_reset() noexcept override { ++resets; }
};

}  // namespace walkman::nodes
