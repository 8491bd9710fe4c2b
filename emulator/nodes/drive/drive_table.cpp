#include "emulator/nodes/drive/drive_table.h"

#include "drivers/canopen/objects.h"
#include "drivers/cia402/words.h"

namespace walkman::nodes {

namespace object = canopen::object;

namespace {

using enum Quantity;
using i8 = std::int8_t;
using i16 = std::int16_t;
using i32 = std::int32_t;
using u8 = std::uint8_t;
using u16 = std::uint16_t;
using u32 = std::uint32_t;

using Rows = std::vector<ObjectRow>;

// 6502h: pp, pv, tq, hm, ip, csp, csv, cst, and the manufacturer's impedance mode.
constexpr u32 kSupportedModes =
    1U << 0U | 1U << 2U | 1U << 3U | 1U << 5U | 1U << 6U | 1U << 7U | 1U << 8U | 1U << 9U | 1U << 16U;
constexpr auto kFactoryMode = static_cast<i8>(cia402::Mode::kCyclicSynchronousPosition);

// CiA 303-2: prefix exponent, numerator, denominator; 10h is rad, 03h is s, and FAh is 10^-6.
constexpr u32 kMicroRadian = 0xFA100000;
constexpr u32 kMicroRadianPerSecond = 0xFA100300;
constexpr u32 kTurn = 6'283'185;  // µrad

constexpr u32 kAcceleration10 = 10'000'000;  // µrad/s²
constexpr u32 kMost = UINT32_MAX;
constexpr std::string_view kStops =
    "0 coast, 1 slow-down ramp 6084h, 2 quick-stop ramp 6085h, 3 torque limit, 4 voltage limit";

/// A value that the drive measures or computes.
template <typename T>
EntryRow measured(std::string_view name, Quantity quantity, std::string_view symbol) {
  return read_only<T>(name).pdo().in(quantity).called(symbol);
}
/// A set-point.
template <typename T>
EntryRow target(std::string_view name, Quantity quantity, std::string_view symbol) {
  return read_write<T>(name).pdo().in(quantity).called(symbol);
}

Rows manufacturer_rows() {
  return {
      record(0x2000, "Emulator identity",
             {read_only<u32>("Build", 0x00010000), read_only<u32>("Model hash").of_the_device(),
              read_only<u16>("Joint number").of_the_device(), read_only<u16>("Bus number").of_the_device()})
          .means(
              "hash of the robot description; place of the joint in it and of the bus in the device table, "
              "counted from 1"),
      record(object::kImpedance, "Impedance",
             {read_write<u32>("Stiffness").of_the_device().in(kStiffness),
              read_write<u32>("Damping").of_the_device().in(kDamping),
              read_only<u32>("Stiffness in use").of_the_device().in(kStiffness),
              read_only<u32>("Damping in use").of_the_device().in(kDamping)})
          .means("used in mode −1"),
      record(0x2011, "Impedance for PDOs",
             {read_write<u16>("Stiffness").of_the_device().pdo().in(kCoarseStiffness).called("stiffness"),
              read_write<u16>("Damping").of_the_device().pdo().in(kCoarseDamping).called("damping")}),
      record(object::kSeriesElastic, "Series elastic element",
             {measured<i32>("Deflection", kPosition, "deflection"),
              measured<i32>("Spring torque", kMilliNewtonMetre, "spring_torque"),
              read_only<u32>("Spring constant").of_the_device().in(kStiffness)}),
      record(object::kTemperature, "Temperatures",
             {measured<i16>("Motor temperature", kDeciCelsius, "motor_temp"),
              measured<i16>("Driver temperature", kDeciCelsius, "driver_temp"),
              read_write<i16>("Warning limit", 800).in(kDeciCelsius),
              read_write<i16>("Trip limit", 1000).in(kDeciCelsius)}),
      record(object::kTemperatureCompact, "Temperatures for PDOs",
             {measured<i8>("Motor temperature", kCelsius, "motor_temp_i8")}),
      record(0x2032, "Supply limits",
             {read_write<u32>("Lower limit").of_the_device().in(kMilliVolt),
              read_write<u32>("Upper limit").of_the_device().in(kMilliVolt)})
          .means("of the DC link"),
      record(0x2040, "Position loop gains",
             {read_write<u32>("P gain").of_the_device().means("mN·m/rad"),
              read_write<u32>("I gain").of_the_device().means("mN·m/(rad·s)"),
              read_write<u32>("D gain").of_the_device().means("mN·m·s/rad")}),
      record(0x2041, "Velocity loop gains",
             {read_write<u32>("P gain").of_the_device().means("mN·m·s/rad"),
              read_write<u32>("I gain").of_the_device().means("mN·m/rad"),
              read_write<u32>("D gain").of_the_device().means("mN·m·s²/rad")}),
      record(0x2042, "Torque loop gains",
             {read_write<u32>("P gain").of_the_device().means("‰"),
              read_write<u32>("I gain").of_the_device().means("‰/s"),
              read_write<u32>("D gain").of_the_device().means(
                  "mN·m·s/rad, on motor velocity minus link velocity")}),
      record(object::kCycleCounter, "Cycle counter",
             {read_only<u16>("Counter").pdo().called("counter").means("SYNCs since boot")}),
  };
}

Rows state_rows() {
  return {
      variable(object::kAbortConnection, read_write<i16>("Abort connection option code", 3)
                                             .one_of({0, 1, 2, 3})
                                             .means("0 nothing, 1 fault, 2 disable voltage, 3 quick stop")),
      variable(object::kErrorCode, read_only<u16>("Error code").pdo().called("error_code")),
      variable(object::kControlword, read_write<u16>("Controlword").pdo().called("controlword")),
      variable(object::kStatusword, read_only<u16>("Statusword").pdo().called("statusword")),
      variable(0x605A, read_write<i16>("Quick stop option code", 2)
                           .one_of({0, 1, 2, 3, 4, 5, 6, 7, 8})
                           .means("0–4 as 605Eh; 5–8 as 1–4, staying in quick stop active")),
      variable(0x605B,
               read_write<i16>("Shutdown option code", 0).one_of({0, 1}).means("0 coast, 1 slow-down ramp")),
      variable(0x605C, read_write<i16>("Disable operation option code", 1)
                           .one_of({0, 1})
                           .means("0 coast, 1 slow-down ramp")),
      variable(0x605D, read_write<i16>("Halt option code", 1).one_of({1, 2, 3, 4}).means("as 605Eh")),
      variable(0x605E,
               read_write<i16>("Fault reaction option code", 2).one_of({0, 1, 2, 3, 4}).means(kStops)),
      variable(object::kMode,
               read_write<i8>("Modes of operation", kFactoryMode)
                   .pdo()
                   .called("mode")
                   .means("unsupported mode: 0609 0030 over SDO, ignored over PDO; 0 no change")),
      variable(object::kModeDisplay,
               read_only<i8>("Modes of operation display", kFactoryMode).pdo().called("mode_display")),
      variable(0x6079, measured<u32>("DC link circuit voltage", kMilliVolt, "dc_link_voltage")),
      variable(0x60FD,
               measured<u32>("Digital inputs", kPlain, "digital_inputs")
                   .means("bit 0 negative limit, 1 positive limit, 2 home; shown only, without effect")),
      array(0x60FE, "Digital outputs",
            {target<u32>("Physical outputs", kPlain, "digital_outputs"),
             target<u32>("Bit mask", kPlain, "output_mask")}),
      variable(0x6402, read_only<u16>("Motor type", 10).means("10 sinusoidal, brushless")),
      variable(object::kSupportedModes, read_only<u32>("Supported drive modes", kSupportedModes)),
  };
}

Rows position_rows() {
  return {
      variable(0x6062, measured<i32>("Position demand value", kPosition, "position_demand")),
      variable(0x6063, measured<i32>("Position actual internal value", kPlain, "position_counts")
                           .means("increments of the motor encoder as seen on the joint side: "
                                  "6064h = 6063h · 6092h / (608Fh · 6091h)")),
      variable(object::kPositionActual, measured<i32>("Position actual value", kPosition, "position_actual")
                                            .means("motor side of the spring; not 0 when the drive boots")),
      variable(0x6065, read_write<u32>("Following error window")
                           .of_the_device()
                           .in(kPosition)
                           .means("FFFFFFFFh = not monitored")),
      variable(0x6066, read_write<u16>("Following error time out").of_the_device().in(kMilliSecond)),
      variable(0x6067, read_write<u32>("Position window", 2000).in(kPosition)),
      variable(0x6068, read_write<u16>("Position window time", 10).in(kMilliSecond)),
      variable(object::kTargetPosition, target<i32>("Target position", kPosition, "target_position")
                                            .means("before operation is enabled: set it to 6064h")),
      variable(0x607C, read_write<i32>("Home offset").in(kPosition)),
      array(0x607D, "Software position limit",
            {read_write<i32>("Min position limit").of_the_device().in(kPosition),
             read_write<i32>("Max position limit").of_the_device().in(kPosition)}),
      array(object::kAdditionalPosition, "Additional position actual value",
            {measured<i32>("Link-side position actual value", kPosition, "link_position")}),
      array(0x60E5, "Additional velocity actual value",
            {measured<i32>("Link-side velocity actual value", kVelocity, "link_velocity")}),
      variable(0x60F4, measured<i32>("Following error actual value", kPosition, "following_error")),
  };
}

Rows profile_rows() {
  return {
      variable(0x607F, read_write<u32>("Max profile velocity").of_the_device().in(kVelocity)),
      variable(0x6080, read_write<u32>("Max motor speed").of_the_device().in(kVelocity)),
      variable(0x6081, read_write<u32>("Profile velocity")
                           .of_the_device()
                           .within(1, kMost)
                           .in(kVelocity)
                           .called("profile_vel")
                           .means("1 rad/s, or 607Fh if that is less")),
      variable(0x6083, read_write<u32>("Profile acceleration", kAcceleration10)
                           .within(1, kMost)
                           .in(kAcceleration)
                           .called("profile_accel")),
      variable(0x6084, read_write<u32>("Profile deceleration", kAcceleration10)
                           .within(1, kMost)
                           .in(kAcceleration)
                           .called("profile_decel")),
      variable(0x6085,
               read_write<u32>("Quick stop deceleration", 40'000'000).within(1, kMost).in(kAcceleration)),
      variable(0x6086, read_write<i16>("Motion profile type").one_of({0}).means("0 linear ramps")),
  };
}

Rows cyclic_rows() {
  return {
      variable(0x60B0, target<i32>("Position offset", kPosition, "position_offset")),
      variable(0x60B1, target<i32>("Velocity offset", kVelocity, "velocity_offset")),
      variable(object::kTorqueOffset, target<i16>("Torque offset", kTorquePerMille, "torque_offset")),
      variable(0x60C0, read_write<i16>("Interpolation sub mode select").one_of({0}).means("0 linear")),
      array(0x60C1, "Interpolation data record",
            {target<i32>("Interpolated position set-point", kPosition, "interp_position")}),
      record(object::kInterpolationPeriod, "Interpolation time period",
             {read_write<u8>("Interpolation time period value").of_the_device().within(1, 255),
              read_write<i8>("Interpolation time index", -3).within(-9, 0)})
          .means("value · 10^index s; equal to the SYNC period of the drive's PDOs"),
  };
}

Rows homing_rows() {
  return {
      variable(0x6098, read_write<i8>("Homing method").one_of({0, 35, 37}).means("those of 60E3h; 0 none")),
      // Kept for masters that write them: the methods offered move nothing.
      array(0x6099, "Homing speeds",
            {read_write<u32>("Speed during search for switch", 100'000).within(1, kMost).in(kVelocity),
             read_write<u32>("Speed during search for zero", 100'000).within(1, kMost).in(kVelocity)})
          .means("without effect: the supported methods move nothing"),
      variable(0x609A, read_write<u32>("Homing acceleration", kAcceleration10)
                           .within(1, kMost)
                           .in(kAcceleration)
                           .means("without effect")),
      [] {
        ObjectRow row = array(
            0x60E3, "Supported homing methods",
            {read_only<i8>("Supported homing method 1", 35), read_only<i8>("Supported homing method 2", 37)});
        return row.means("35 and 37: the present position");
      }(),
  };
}

Rows scale_rows() {
  return {
      array(0x608F, "Position encoder resolution",
            {read_only<u32>("Encoder increments").of_the_device(), read_only<u32>("Motor revolutions", 1)}),
      array(0x6091, "Gear ratio",
            {read_only<u32>("Motor shaft revolutions", 1), read_only<u32>("Driving shaft revolutions", 1)})
          .means("everything is on the joint side of the gearbox"),
      array(0x6092, "Feed constant", {read_only<u32>("Feed", kTurn), read_only<u32>("Shaft revolutions", 1)})
          .means("µrad in one turn"),
      variable(0x60A8, read_only<u32>("SI unit position", kMicroRadian).means("µrad (CiA 303-2)")),
      variable(0x60A9, read_only<u32>("SI unit velocity", kMicroRadianPerSecond).means("µrad/s")),
  };
}

Rows velocity_rows() {
  return {
      variable(0x606B, measured<i32>("Velocity demand value", kVelocity, "velocity_demand")),
      variable(object::kVelocityActual, measured<i32>("Velocity actual value", kVelocity, "velocity_actual")),
      variable(0x606D, read_write<u16>("Velocity window", 50'000).in(kVelocity)),
      variable(0x606E, read_write<u16>("Velocity window time", 10).in(kMilliSecond)),
      variable(0x606F, read_write<u16>("Velocity threshold", 20'000).in(kVelocity)),
      variable(0x6070, read_write<u16>("Velocity threshold time", 10).in(kMilliSecond)),
      variable(object::kTargetVelocity, target<i32>("Target velocity", kVelocity, "target_velocity")),
  };
}

Rows torque_rows() {
  return {
      variable(object::kTargetTorque, target<i16>("Target torque", kTorquePerMille, "target_torque")),
      variable(
          object::kMaxTorque,
          target<u16>("Max torque", kTorquePerMille, "max_torque").of_the_device().means("the peak torque")),
      variable(0x6073,
               read_write<u16>("Max current").of_the_device().in(kCurrentPerMille).called("max_current")),
      variable(0x6074, measured<i16>("Torque demand value", kTorquePerMille, "torque_demand")),
      variable(0x6075, read_only<u32>("Motor rated current").of_the_device().in(kMilliAmpere)),
      variable(object::kRatedTorque,
               read_only<u32>("Motor rated torque").of_the_device().in(kMilliNewtonMetre)),
      variable(object::kTorqueActual, measured<i16>("Torque actual value", kTorquePerMille, "torque_actual")
                                          .means("of the series spring on the link")),
      variable(0x6078, measured<i16>("Current actual value", kCurrentPerMille, "current_actual")),
      variable(
          0x6087,
          read_write<u32>("Torque slope", 10'000).within(1, kMost).in(kTorqueSlope).called("torque_slope")),
      variable(0x6088, read_write<i16>("Torque profile type").one_of({0}).means("0 linear ramp")),
  };
}

}  // namespace

ObjectTable drive_table() {
  static const Rows kRows = [] {
    Rows all;
    for (const Rows& part : {manufacturer_rows(), state_rows(), position_rows(), profile_rows(),
                             cyclic_rows(), homing_rows(), scale_rows(), velocity_rows(), torque_rows()}) {
      all.insert(all.end(), part.begin(), part.end());
    }
    return all;
  }();
  return kRows;
}

CanopenSlave::PdoSet drive_rpdos(const DriveParameters& p) {
  const std::uint8_t n = p.sync_divider;
  return {{
      {true,
       255,
       0,
       {mapped(object::kControlword, 0, 16), mapped(object::kMode, 0, 8),
        mapped(object::kTargetTorque, 0, 16)}},
      {true, n, 0, {mapped(object::kTargetPosition, 0, 32), mapped(object::kTargetVelocity, 0, 32)}},
      {false, n, 0, {}},
      {false, n, 0, {}},
  }};
}

CanopenSlave::PdoSet drive_tpdos(const DriveParameters& p) {
  const std::uint8_t n = p.sync_divider;
  return {{
      {true,
       n,
       0,
       {mapped(object::kStatusword, 0, 16), mapped(object::kModeDisplay, 0, 8),
        mapped(object::kTorqueActual, 0, 16)}},
      {true, n, 0, {mapped(object::kPositionActual, 0, 32), mapped(object::kVelocityActual, 0, 32)}},
      {false, n, 0, {}},
      {true,
       255,
       100,
       {mapped(object::kErrorCode, 0, 16), mapped(object::kTemperatureCompact, 1, 8),
        mapped(object::kCycleCounter, 1, 16)}},
  }};
}

}  // namespace walkman::nodes
