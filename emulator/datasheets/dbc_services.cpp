#include "drivers/canopen/cob_id.h"
#include "emulator/datasheets/dbc_model.h"

namespace walkman::datasheets {

namespace cob_id = canopen::cob_id;

namespace {

constexpr std::uint32_t kLssResponse = 0x7E4;
constexpr std::uint32_t kLssRequest = 0x7E5;

DbcSignal plain(std::string name, int start, int length) {
  DbcSignal signal;
  signal.name = std::move(name);
  signal.start = start;
  signal.length = length;
  return signal;
}

DbcMessage sdo(const std::string& device, std::uint32_t id, bool request) {
  const std::string stem = device + (request ? "_sdo_req_" : "_sdo_rsp_");
  DbcMessage message;
  message.id = id;
  message.name = device + (request ? "_SDO_request" : "_SDO_response");
  message.length = 8;
  message.sender = request ? std::string(kComputer) : device;
  message.receivers = {request ? device : std::string(kComputer)};
  message.signals = {plain(stem + "command", 0, 8), plain(stem + "index", 8, 16), plain(stem + "sub", 24, 8),
                     plain(stem + "data", 32, 32)};
  message.comment = "First frame of a transfer; segments carry 7 bytes of data after the command";
  return message;
}

DbcMessage lss(std::uint32_t id, const char* name, const std::string& sender,
               std::vector<std::string> receivers) {
  DbcMessage message;
  message.id = id;
  message.name = name;
  message.length = 8;
  message.sender = sender;
  message.receivers = std::move(receivers);
  const std::string stem = id == kLssRequest ? "lss_req_" : "lss_rsp_";
  message.signals = {plain(stem + "command", 0, 8), plain(stem + "data", 8, 32)};
  message.comment = "CiA 305";
  return message;
}

}  // namespace

std::vector<DbcMessage> device_services(const std::string& device, std::uint8_t node_id) {
  DbcMessage emcy;
  emcy.id = cob_id::emcy(node_id);
  emcy.name = device + "_EMCY";
  emcy.length = 8;
  emcy.sender = device;
  emcy.receivers = {kComputer};
  emcy.signals = {plain(device + "_emcy_code", 0, 16), plain(device + "_emcy_register", 16, 8),
                  plain(device + "_emcy_detail", 24, 40)};
  emcy.comment = "Emergency: error code, error register 1001h, manufacturer's five bytes";

  DbcMessage state;
  state.id = cob_id::error_control(node_id);
  state.name = device + "_heartbeat";
  state.length = 1;
  state.sender = device;
  state.receivers = {kComputer};
  state.signals = {plain(device + "_nmt_state", 0, 7), plain(device + "_guard_toggle", 7, 1)};
  state.signals[0].values = {{0, "boot-up"}, {4, "stopped"}, {5, "operational"}, {127, "pre-operational"}};
  state.comment = "Error control: boot-up, heartbeat, answer to node guarding";

  return {emcy, sdo(device, cob_id::sdo_request(node_id), true),
          sdo(device, cob_id::sdo_response(node_id), false), state};
}

std::vector<DbcMessage> bus_services(const std::vector<std::string>& devices) {
  DbcMessage nmt;
  nmt.id = cob_id::kNmt;
  nmt.name = "NMT";
  nmt.length = 2;
  nmt.sender = kComputer;
  nmt.receivers = devices;
  nmt.signals = {plain("nmt_command", 0, 8), plain("nmt_node_id", 8, 8)};
  nmt.signals[0].values = {{1, "start"},
                           {2, "stop"},
                           {128, "enter pre-operational"},
                           {129, "reset node"},
                           {130, "reset communication"}};
  nmt.comment = "Node-ID 0 is all nodes";

  DbcMessage sync;
  sync.id = cob_id::kSync;
  sync.name = "SYNC";
  sync.sender = kComputer;
  sync.comment = "Without counter";

  DbcMessage time;
  time.id = cob_id::kTime;
  time.name = "TIME";
  time.length = 6;
  time.sender = kComputer;
  time.receivers = devices;
  time.signals = {plain("time_of_day", 0, 28), plain("time_days", 32, 16)};
  time.signals[0].factor = 1e-3;
  time.signals[0].unit = "s";
  time.signals[0].comment = "After midnight";
  time.signals[1].unit = "d";
  time.signals[1].comment = "Since 1984-01-01";
  time.comment = "TIME_OF_DAY";

  return {nmt, sync, time, lss(kLssRequest, "LSS_request", kComputer, devices),
          lss(kLssResponse, "LSS_response", "Vector__XXX", {kComputer})};
}

}  // namespace walkman::datasheets
