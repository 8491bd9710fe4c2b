// SDO requests into a node's server: expedited, segmented and block transfers that begin, continue and end
// correctly or not. The data of a complete block download must be in the object.

#include <array>
#include <string>

#include "drivers/canopen/little_endian.h"
#include "emulator/nodes/cia301/block_crc.h"
#include "emulator/nodes/drive/drive_node.h"
#include "tests/fuzz/node_talk.h"
#include "tests/unit/nodes/test_drive.h"

namespace walkman::fuzz {
namespace {

constexpr std::uint8_t kNode = 5;
constexpr std::array<std::uint16_t, 20> kIndices = {0x1000, 0x1003, 0x1005, 0x1008, 0x1010, 0x1011, 0x1014,
                                                    0x1016, 0x1017, 0x1018, 0x1021, 0x1400, 0x1600, 0x1800,
                                                    0x1A00, 0x2040, 0x2060, 0x2061, 0x6040, 0x60C2};
constexpr std::uint16_t kNote = 0x2060;

class SdoTalk {
 public:
  explicit SdoTalk(Input& input) : input_(input) {
    drive_.store_eds(std::string(2000, 'e'));
    talk_.heard = [](const can::Frame& frame) {
      if (frame.id == canopen::cob_id::sdo_response(kNode))
        require(frame.length == 8, "an SDO response has 8 bytes");
    };
  }

  void run() {
    while (!input_.empty()) {
      const unsigned how = input_.byte();
      switch (how & 7U) {
        case 0:
          request(input_.bytes(8));
          break;
        case 1:  // after a long time
          talk_.wait(input_.pause(), (how & 8U) != 0);
          break;
        case 2:
          block_download(how);
          break;
        default:
          aimed(input_.byte());
      }
      talk_.wait(std::chrono::microseconds(200), (how & 128U) != 0);
    }
  }

 private:
  void request(std::span<const std::uint8_t> bytes) {
    can::Frame frame(canopen::cob_id::sdo_request(kNode), bytes);
    frame.length = 8;
    talk_.hear(frame);
  }
  /// Sends a command for an existing object, with arbitrary data.
  void aimed(std::uint8_t command) {
    std::array<std::uint8_t, 8> bytes{command};
    canopen::put(bytes.data() + 1, kIndices[input_.byte() % kIndices.size()]);
    bytes[3] = static_cast<std::uint8_t>(input_.byte() % 9);
    const auto rest = input_.bytes(4);
    std::copy(rest.begin(), rest.end(), bytes.begin() + 4);
    request(bytes);
  }
  /// Downloads the user note in blocks, with a wrong CRC or a missing segment if `how` says so.
  void block_download(unsigned how) {
    const bool wrong_crc = (how & 8U) != 0, gap = (how & 16U) != 0, announced = (how & 32U) != 0;
    std::string note(input_.word() % 1100, 'x');
    for (std::size_t i = 0; i < note.size(); i += 37) note[i] = static_cast<char>(' ' + input_.byte() % 95);
    std::array<std::uint8_t, 8> bytes{static_cast<std::uint8_t>(announced ? 0xC6 : 0xC4)};
    canopen::put(bytes.data() + 1, kNote);
    canopen::put(bytes.data() + 4, static_cast<std::uint32_t>(announced ? note.size() : 0));
    request(bytes);
    const std::size_t count = std::max<std::size_t>(1, (note.size() + 6) / 7);
    for (std::size_t i = 0; i < count; ++i) {
      if (gap && i == count / 2) continue;
      bytes.fill(0);
      bytes[0] = static_cast<std::uint8_t>(i % 127 + 1);
      if (i + 1 == count) bytes[0] |= 0x80U;
      for (std::size_t k = 0; k < 7 && 7 * i + k < note.size(); ++k)
        bytes[k + 1] = static_cast<std::uint8_t>(note[7 * i + k]);
      request(bytes);
      talk_.wait(std::chrono::microseconds(130), false);
    }
    bytes.fill(0);
    bytes[0] = static_cast<std::uint8_t>(0xC1U | (7 * count - note.size()) << 2U);
    const auto crc = nodes::block_crc({reinterpret_cast<const std::uint8_t*>(note.data()), note.size()});
    canopen::put(bytes.data() + 1, static_cast<std::uint16_t>(wrong_crc ? crc ^ 1U : crc));
    const std::string before = drive_.dictionary().find(kNote, 0)->text;
    bool taken = false;
    const auto heard = talk_.heard;
    talk_.heard = [&](const can::Frame& frame) {
      heard(frame);
      taken = taken || (frame.id == canopen::cob_id::sdo_response(kNode) && frame.data[0] == 0xA1);
    };
    request(bytes);
    talk_.wait(std::chrono::microseconds(200), false);
    talk_.heard = heard;
    const std::string& after = drive_.dictionary().find(kNote, 0)->text;
    require(after == (taken ? note : before),
            "an object holds what a block download brought, or what it held");
    require(!taken || !(wrong_crc || gap), "a block download with a wrong CRC or a gap is refused");
  }

  Input& input_;
  nodes::DriveNode drive_{nodes::test_drive(kNode)};
  NodeTalk talk_{drive_, false};
};

}  // namespace
}  // namespace walkman::fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  walkman::fuzz::Input input(data, size);
  walkman::fuzz::SdoTalk(input).run();
  return 0;
}
