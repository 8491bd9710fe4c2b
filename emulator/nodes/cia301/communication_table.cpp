#include "emulator/nodes/cia301/communication_table.h"

#include "drivers/canopen/cob_id.h"
#include "drivers/canopen/objects.h"

namespace walkman::nodes {
namespace {

using enum Quantity;
using u8 = std::uint8_t;
using u16 = std::uint16_t;
using u32 = std::uint32_t;

constexpr std::size_t kUserNoteBytes = 1024;
constexpr u8 kPdoEntries = 8;
constexpr u16 kPdos = 4;

ObjectRow error_history() {
  ObjectRow row = array_of(0x1003, "Pre-defined error field", read_only<u32>("Standard error field {}"), 8);
  row.zero = read_write<u8>("Number of errors");
  return row.means(
      "newest first; writing 0 to :0 clears it, else 0609 0030; an empty entry answers 0800 0024");
}

/// Communication parameters of the PDOs from `index` on, named "RPDO {}" or "TPDO {}".
ObjectRow pdo_communication(u16 index, std::string_view name, std::string_view cob_id, bool transmit) {
  std::vector<EntryRow> entries{
      read_write<u32>(cob_id).of_the_device().plus_node_id().means(
          "bit 31 = off; TPDO: bit 30 = no remote request"),
      read_write<u8>("Transmission type")
          .of_the_device()
          .means(transmit ? "0–240 with SYNC, 252 and 253 on request, 254 and 255 by event"
                          : "0–240 takes effect with SYNC, 254 and 255 at once"),
      read_write<u16>("Inhibit time").in(kHundredMicroSeconds),
      {},
      read_write<u16>("Event timer")
          .of_the_device()
          .in(kMilliSecond)
          .means(transmit ? "" : "deadline: EMCY 8250h")};
  if (transmit) {
    entries.push_back(
        read_write<u8>("SYNC start value").within(0, 240).means("counter of the first SYNC; 0 any"));
  }
  ObjectRow row = record(index, name, std::move(entries));
  row.objects = kPdos;
  return row;
}

ObjectRow pdo_mapping(u16 index, std::string_view name) {
  ObjectRow row = array_of(index, name, read_write<u32>("Mapped object {}").of_the_device(), kPdoEntries);
  row.code = ObjectCode::kRecord;
  row.zero = read_write<u8>("Number of mapped application objects in PDO").of_the_device();
  row.objects = kPdos;
  return row.means("index << 16, sub-index << 8, bits; 64 entries with CAN FD");
}

std::vector<ObjectRow> rows() {
  return {
      variable(0x1000, read_only<u32>("Device type").of_the_device()),
      variable(0x1001, read_only<u8>("Error register").pdo().called("error_register")),
      error_history(),
      variable(0x1005, read_write<u32>("COB-ID SYNC message", canopen::cob_id::kSync)
                           .means("bit 30 = produce; bit 31 has no effect")),
      variable(0x1006,
               read_write<u32>("Communication cycle period").in(kMicroSecond).means("0, or at least 100")),
      variable(0x1007, read_write<u32>("Synchronous window length").in(kMicroSecond).means("0 = none")),
      variable(0x1008,
               text("Manufacturer device name").of_the_device().means("name of the URDF's joint or frame")),
      variable(0x1009, text("Manufacturer hardware version").of_the_device()),
      variable(0x100A, text("Manufacturer software version").of_the_device()),
      variable(0x100C, read_write<u16>("Guard time").in(kMilliSecond)),
      variable(0x100D, read_write<u8>("Life time factor")),
      array(0x1010, "Store parameters",
            {read_write<u32>("Save all parameters", 1), read_write<u32>("Save communication parameters", 1),
             read_write<u32>("Save application parameters", 1)})
          .means("\"save\" 65766173h, else 0800 0020; :2 is 1000h–1FFFh, :3 is 2000h–FFFFh"),
      array(0x1011, "Restore default parameters",
            {read_write<u32>("Restore all default parameters", 1),
             read_write<u32>("Restore communication default parameters", 1),
             read_write<u32>("Restore application default parameters", 1)})
          .means("\"load\" 64616F6Ch, else 0800 0020"),
      variable(0x1012, read_write<u32>("COB-ID time stamp object", 0x80000000U | canopen::cob_id::kTime)
                           .means("bit 31 = consume")),
      variable(0x1014,
               read_write<u32>("COB-ID EMCY", canopen::cob_id::emcy(0)).plus_node_id().means("bit 31 = off")),
      variable(0x1015, read_write<u16>("Inhibit time EMCY").in(kHundredMicroSeconds)),
      array_of(0x1016, "Consumer heartbeat time", read_write<u32>("Consumer heartbeat time {}"), 4)
          .means("node << 16 + ms"),
      variable(0x1017, read_write<u16>("Producer heartbeat time").in(kMilliSecond)),
      record(0x1018, "Identity object",
             {read_only<u32>("Vendor-ID").of_the_device(), read_only<u32>("Product code").of_the_device(),
              read_only<u32>("Revision number").of_the_device(),
              read_only<u32>("Serial number").of_the_device()}),
      variable(0x1019, read_write<u8>("Synchronous counter overflow value")
                           .means("0, or 2–240; only while 1006h = 0, else 0800 0022")),
      variable(0x1021, domain("Store EDS").means("the device's own EDS; 0800 0024 if it has none")),
      variable(0x1022, read_only<u8>("Store format").means("0 = plain text")),
      array(0x1029, "Error behaviour object", {read_write<u8>("Communication error").within(0, 2)})
          .means("0 to pre-operational, 1 nothing, 2 stopped"),
      record(
          0x1200, "SDO server parameter",
          {read_only<u32>("COB-ID client to server (rx)", canopen::cob_id::sdo_request(0)).plus_node_id(),
           read_only<u32>("COB-ID server to client (tx)", canopen::cob_id::sdo_response(0)).plus_node_id()}),
      pdo_communication(0x1400, "RPDO {} communication parameter", "COB-ID used by RPDO", false),
      pdo_mapping(0x1600, "RPDO {} mapping parameter"),
      pdo_communication(0x1800, "TPDO {} communication parameter", "COB-ID used by TPDO", true),
      pdo_mapping(0x1A00, "TPDO {} mapping parameter"),
      variable(0x1F80,
               read_write<u32>("NMT startup", 4)
                   .means("4 waits in pre-operational after boot-up, 0 enters operational by itself")),
      variable(
          canopen::object::kPdoProtection,
          read_write<u16>("PDO protection")
              .pdo()
              .called("protection")
              .means("last object of a PDO: count of its transmissions, then CRC-8; no meaning over SDO")),
      variable(kUserNote, string("User note", kUserNoteBytes).means("up to 1024 characters from 20h to 7Eh")),
      record(kNodeClock, "Network time",
             {read_only<u32>("Milliseconds after midnight"), read_only<u16>("Days since 1984-01-01")})
          .means("the node's clock, as TIME set it"),
  };
}

}  // namespace

ObjectTable communication_table() {
  static const std::vector<ObjectRow> kRows = rows();
  return kRows;
}

}  // namespace walkman::nodes
