// The sensor that docs/extending.md adds, on a bus, in a plant.

#include "examples/load_cell/load_cell.h"

#include <cstring>

#include "drivers/robot/boot.h"
#include "emulator/bus/can_bus.h"
#include "emulator/datasheets/eds_writer.h"
#include "examples/load_cell/emulated_load_cell.h"
#include "tests/unit/nodes/conversation.h"
#include "tests/unit/plant/whole_plant.h"

namespace walkman {
namespace {

using nodes::Conversation;
using nodes::Frames;
using std::chrono::milliseconds;

std::int16_t first_i16(const std::vector<can::StampedFrame>& frames, std::uint32_t id) {
  for (const can::StampedFrame& frame : frames) {
    if (frame.frame.id != id) continue;
    std::int16_t value = 0;
    std::memcpy(&value, frame.frame.data.data(), sizeof value);
    return value;
  }
  ADD_FAILURE() << "no frame " << std::hex << id;
  return 0;
}

class LoadCell : public plant::WholePlant {};

// Node-ID 18, NMT start, SYNC: TPDO1 contains the weight of the empty hand in 0.1 N, and the counter of the
// sample.
TEST_F(LoadCell, TellsTheForceOverItsBus) {
  const auto plant = build();
  EmulatedLoadCell cell(*plant, 0, {18, "r_arm_load_cell", 18});
  Conversation talk(cell.node());
  talk.listen(milliseconds(2));
  talk.ask("000#0112");
  for (int i = 0; i < 200; ++i) {
    run(*plant, 1);
    cell.sample();
  }
  const double truth = plant->F_So_S(0).force.z();
  ASSERT_GT(std::abs(truth), 2.0);
  talk.send("080#");
  const auto heard = talk.listen_stamped(milliseconds(2));
  EXPECT_NEAR(first_i16(heard, 0x192) * 0.1, truth, 0.3);  // half the resolution, and the rounding on the bus
}

TEST_F(LoadCell, TellsAnOverload) {
  nodes::LoadCellNode cell({18, "r_arm_load_cell", 18});
  Conversation talk(cell);
  talk.listen(milliseconds(2));
  talk.ask("000#0112");
  cell.sample(2500);
  EXPECT_EQ(talk.listen(milliseconds(1)), Frames{"092#01FF810000000000"});
  EXPECT_EQ(talk.ask("080#"), Frames{"192#204E010002"});  // 2000.0 N, sample 1, positive overload
}

// Both sides of the bus: booted, read and judged like any other device.
TEST_F(LoadCell, IsReadByItsDriver) {
  const auto plant = build();
  EmulatedLoadCell cell(*plant, 0, {18, "r_arm_load_cell", 18});
  bus::CanBus wire("rarm", "can_rarm");
  wire.attach(cell.node());
  const robot::RobotOptions options;
  canopen::NodeSettings settings;
  settings.node_id = 18;
  settings.name = "r_arm_load_cell";
  settings.interface = "can_rarm";
  settings.noun = "load cell";
  settings.pdos = cia404::LoadCell::factory_pdos();
  auto device = std::make_unique<cia404::LoadCell>(settings);
  const cia404::LoadCellSample& sample = device->sample();
  std::vector<std::unique_ptr<robot::RobotBus>> buses;
  buses.push_back(std::make_unique<robot::RobotBus>(wire.computer_port(), can::BitRates{}, 0.1, options));
  robot::RobotBus& bus = *buses.front();
  bus.add(std::move(device));
  robot::Boot boot(buses, options);

  Time now{};
  std::uint64_t syncs = 0;
  const auto send_cycle = [&] {
    bus.master().sync();
    bus.master().heartbeat(now);
    bus.master().send_requests();
    bus.master().end_cycle(now);
    ++syncs;
    for (int step = 0; step < 5; ++step) {
      run(*plant, 1);
      cell.sample();
    }
    wire.advance(now += options.cycle);
    bus.receive(now);
  };
  boot.begin(now);
  while (!boot.step(now, syncs)) send_cycle();
  for (int i = 0; i < 40; ++i) {
    send_cycle();
    const auto fault = bus.judge(now);
    ASSERT_FALSE(fault) << describe(*fault).text;
  }
  EXPECT_NEAR(sample.force, plant->F_So_S(0).force.z(), 0.5);
  EXPECT_LT(sample.age, options.cycle);
  EXPECT_EQ(sample.status, 0);
  const auto silent = bus.judge(now + milliseconds(20));
  ASSERT_TRUE(silent);
  EXPECT_EQ(describe(*silent).text.find("load cell r_arm_load_cell (node 18 on can_rarm): no TPDO1 for "),
            0U);
}

TEST_F(LoadCell, HasADataSheetWithoutAnotherTable) {
  const nodes::LoadCellNode cell({18, "r_arm_load_cell", 18});
  const std::string text =
      datasheets::eds_text({"load_cell.eds", "Load cell", "load_cell", "Load cell, CiA 404"},
                           std::vector<datasheets::EdsDevice>{{18, &cell.dictionary()}});
  EXPECT_NE(text.find("[7130sub1]\r\nParameterName=Fx\r\n"), std::string::npos);
  EXPECT_NE(text.find("\r\nDefaultValue=0x71300110\r\n"), std::string::npos);  // TPDO1 maps it
}

}  // namespace
}  // namespace walkman
