#include "emulator/faults/injectable_fault.h"

#include <algorithm>
#include <array>

namespace walkman::faults {
namespace {

constexpr Parameter kShare{"share", "", 0, 1, 1, "of the frames, drawn by the seed"};
constexpr double kMostForce = 1e4, kMostTorque = 1e3;

const std::vector<InjectableFault>& catalogue() {
  using enum Target;
  static const std::vector<InjectableFault> kinds = {
      // The wire
      {"frame-drop",
       kFrames,
       "frames are lost; their sender notices nothing",
       "data-stale or heartbeat-lost once a limit is passed",
       {{"share", "", 0, 1, 0.1, "of the frames, drawn by the seed"}}},
      {"frame-burst-loss",
       kFrames,
       "so many frames in a row are lost",
       "data-stale from three SYNCs on",
       {{"frames", "", 1, 1e6, 10, "lost in a row"}}},
      {"frame-delay",
       kFrames,
       "frames are held back and sent later",
       "data-stale",
       {{"delay", "s", 0.001, 10, 0.02, "of each frame"}, kShare}},
      {"frame-duplicate", kFrames, "frames are sent a second time", "nothing: the newest counts", {kShare}},
      {"frame-reorder",
       kFrames,
       "a frame goes behind the next one",
       "nothing: the newest of each counts",
       {kShare}},
      {"payload-bitflip",
       kFrames,
       "bits of the payload are turned over behind the CRC",
       "not-finite where a value leaves what can be measured",
       {{"bits", "", 1, 64, 1, "in each of them, drawn by the seed"},
        {"share", "", 0, 1, 0.05, "of the frames, drawn by the seed"}}},
      {"wrong-length",
       kFrames,
       "frames have more or fewer bytes than they should",
       "frames are ignored and counted; data-stale",
       {{"bytes", "", -8, 8, -1, "more; less where negative"}, kShare}},
      {"babbling-idiot",
       kFrames,
       "something floods the bus with one identifier",
       "bus-flooded",
       {{"id", "", 0, 0x7FF, 1, "of the frames"}, {"rate", "1/s", 1, 20000, 20000, "of the frames"}}},
      {"bus-off",
       kDevice,
       "a device's transmitter breaks: every frame of it ends in an error frame",
       "heartbeat-lost or data-stale, emergency 8140h when it is back",
       {}},
      {"error-passive",
       kDevice,
       "a bad connection keeps a device's controller error-passive",
       "emergency 8120h of the device",
       {}},
      {"no-acknowledge", kDevice, "nobody acknowledges a device's frames", "data-stale", {}},

      // Nodes
      {"heartbeat-loss",
       kDevice,
       "its heartbeats are lost, all else goes on",
       "heartbeat-lost after 250 ms",
       {}},
      {"silent-reboot", kDevice, "it restarts by itself", "unexpected-boot-up", {}},
      {"nmt-preop-drop", kDevice, "it falls to NMT pre-operational by itself", "nmt-state or data-stale", {}},
      {"sdo-timeout",
       kDevice,
       "its answers to SDO requests are lost",
       "the boot ends with the object's name",
       {}},
      {"pdo-frozen",
       kDevice,
       "its firmware hangs: TPDOs repeat their last bytes, heartbeats go on",
       "data-stale: its counter 2050h is stuck, after 250 ms",
       {}},

      // Sensors
      {"encoder-offset",
       kDrive,
       "an encoder reads more than it should",
       "depends on the size",
       {{"offset", "rad", -3.2, 3.2, 0.05, "of the reading"}, {"side", "", 0, 1, 1, "0 motor, 1 link"}}},
      {"encoder-stuck",
       kDrive,
       "an encoder stands still",
       "depends on the motion",
       {{"side", "", 0, 1, 1, "0 motor, 1 link"}}},
      {"temperature-high",
       kDrive,
       "the winding's thermistor reads too hot",
       "emergency 4310h",
       {{"rise", "K", 0, 200, 150, "above the truth"}}},
      {"ft-bias-drift",
       kForceTorque,
       "readings run away",
       "the first weighing is refused, and the object lowered",
       {{"force", "N/s", -kMostForce, kMostForce, 0, "of Fx, Fy and Fz"},
        {"torque", "N·m/s", -kMostTorque, kMostTorque, 0.05, "of Tx, Ty and Tz"}}},
      {"ft-sign",
       kForceTorque,
       "an axis is wired the wrong way round",
       "the first weighing is refused, and the object lowered",
       {{"axis", "", 0, 5, 2, "Fx, Fy, Fz, Tx, Ty, Tz"}}},
      {"ft-gain",
       kForceTorque,
       "readings are too large or too small",
       "the first weighing is refused, and the object lowered",
       {{"gain", "", -10, 10, 1.3, "reading over truth, of all axes"}}},

      // Actuators
      {"torque-loss",
       kDrive,
       "the motor gives a share of the torque asked for",
       "drive-fault 8611h where the load needs more",
       {{"share", "", 0, 1, 0, "of the torque"}}},
      {"joint-locked",
       kDrive,
       "brake or gear jam: the motor does not move",
       "drive-fault 8611h in motion",
       {}},
      {"brake-drag",
       kDrive,
       "the brake drags",
       "more current; drive-fault 8611h where it is too much",
       {{"torque", "N·m", 0, kMostTorque, 20, "against the motion, on the joint side"}}},
      {"overcurrent-trip", kDrive, "the power stage trips", "emergency 2310h", {}},
      {"undervoltage",
       kDrive,
       "the DC link's voltage falls",
       "emergency 3220h",
       {{"voltage", "V", 0, 100, 20, "of the DC link"}}},

      // Camera
      {"cloud-missing", kCamera, "no frame is exposed any more", "the look is refused", {}},
      {"cloud-dropout",
       kCamera,
       "pixels have no match",
       "fewer points, fewer handles",
       {{"share", "", 0, 1, 0.5, "of the pixels, drawn by the seed"}}},
      {"extrinsic-error",
       kCamera,
       "the camera is not where the model has it",
       "nothing by itself",
       {{"shift", "m", -0.2, 0.2, 0.01, "along the image's x"},
        {"turn", "rad", -0.5, 0.5, 0, "about the optical axis"}}},
  };
  return kinds;
}

bool same(std::string_view name, std::string_view written) {
  return std::equal(name.begin(), name.end(), written.begin(), written.end(),
                    [](char a, char b) { return a == b || (a == '-' && b == '_'); });
}

}  // namespace

std::span<const InjectableFault> injectable_faults() { return catalogue(); }

const InjectableFault* find_fault(std::string_view name) {
  const auto kinds = injectable_faults();
  const auto found = std::find_if(kinds.begin(), kinds.end(),
                                  [&](const InjectableFault& kind) { return same(kind.name, name); });
  return found == kinds.end() ? nullptr : &*found;
}

std::string_view to_word(Target target) {
  constexpr std::array<std::string_view, 5> kWords = {"frames", "device", "drive", "force-torque", "camera"};
  return kWords[static_cast<std::size_t>(target)];
}

}  // namespace walkman::faults
