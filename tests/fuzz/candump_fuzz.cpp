// A candump log: what is read can be written, and is the same when it is read again.

#include <string>
#include <vector>

#include "emulator/bus/frame_length.h"
#include "emulator/logs/candump_log.h"
#include "emulator/logs/candump_reader.h"
#include "tests/fuzz/input.h"
#include "tests/fuzz/input_file.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace walkman;
  static fuzz::InputFile file("input.log"), again("again.log");
  file.write({data, size});
  std::vector<bus::LoggedFrame> frames;
  std::string written;
  file.read_or_refuse([&] {
    bus::CandumpReader reader(file.path());
    for (bus::LoggedFrame frame; reader.next(frame);) {
      fuzz::require(frame.stamped.frame.error || bus::is_sendable(frame.stamped.frame),
                    "a bus can carry a frame");
      frames.push_back(frame);
      written += bus::candump_line(frame.interface_name, frame.stamped);
    }
  });
  again.write({reinterpret_cast<const std::uint8_t*>(written.data()), written.size()});
  bus::CandumpReader reader(again.path());
  for (const bus::LoggedFrame& frame : frames) {
    bus::LoggedFrame same;
    fuzz::require(reader.next(same) && same.interface_name == frame.interface_name &&
                      same.stamped.frame == frame.stamped.frame &&
                      same.stamped.time == std::chrono::floor<std::chrono::microseconds>(frame.stamped.time),
                  "a frame is the same when it is read again");
  }
  bus::LoggedFrame none;
  fuzz::require(frames.empty() || !reader.next(none), "there are no more frames than were written");
  return 0;
}
