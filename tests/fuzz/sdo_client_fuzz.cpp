// A server's answers into the master's SDO client, while it reads and writes objects.

#include <array>

#include "drivers/canopen/cob_id.h"
#include "drivers/canopen/sdo_client.h"
#include "tests/fuzz/input.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace walkman;
  using canopen::SdoClient;
  constexpr std::uint8_t kServer = 5;
  constexpr Time kTimeout = std::chrono::milliseconds(50);
  fuzz::Input input(data, size);
  SdoClient client(kServer, kTimeout);
  Time now{};
  while (!input.empty()) {
    const unsigned how = input.byte();
    const canopen::ObjectAddress object{static_cast<std::uint16_t>(0x2000 + (how >> 4U)), 0};
    switch (how & 7U) {
      case 0:
        client.upload(object, now);
        break;
      case 1: {
        std::array<std::uint8_t, 300> bytes{};
        const std::size_t count = input.word() % bytes.size();
        const auto given = input.bytes(count % 16);
        std::copy(given.begin(), given.end(), bytes.begin());
        client.download(object, std::span(bytes).first(count), now);
        break;
      }
      case 2:
        now += input.pause();
        client.poll(now);
        break;
      case 3: {  // an answer to this very object
        can::Frame frame(canopen::cob_id::sdo_response(kServer),
                         {input.byte(), static_cast<std::uint8_t>(client.address().index),
                          static_cast<std::uint8_t>(client.address().index >> 8U), client.address().sub});
        frame.length = 8;
        const auto rest = input.bytes(4);
        std::copy(rest.begin(), rest.end(), frame.data.begin() + 4);
        client.receive(frame, now);
        break;
      }
      case 4: {
        can::Frame frame(canopen::cob_id::sdo_response(kServer), input.bytes(8));
        if ((how & 8U) != 0) frame.length = 8;
        client.receive(frame, now);
        break;
      }
      default:
        if (client.pending() != nullptr) client.sent();
    }
    if (const can::Frame* request = client.pending())
      fuzz::require(request->id == canopen::cob_id::sdo_request(kServer) && request->length == 8,
                    "an SDO request has the server's identifier and 8 bytes");
    if (client.state() == SdoClient::State::kDone)
      fuzz::require(client.data().size() <= SdoClient::kCapacity, "an upload fits");
    if (client.state() == SdoClient::State::kFailed)
      fuzz::require(!canopen::describe(client.abort_code()).empty(), "a failure has a reason");
  }
  client.poll(now + kTimeout + Time(1));
  fuzz::require(client.state() != SdoClient::State::kBusy || client.pending() != nullptr,
                "a transfer without an answer ends");
  return 0;
}
