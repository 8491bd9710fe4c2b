#include "emulator/export/object_names.h"

namespace walkman::device_files {

std::span<const ObjectName> manufacturer_names() {
  using enum ObjectCode;
  using enum Quantity;
  static const std::vector<ObjectName> kTable = {
      {0x2000,
       0x2000,
       kRecord,
       {"Emulator identity"},
       {{"Build"}, {"Model hash"}, {"Joint number"}, {"Bus number"}}},
      {0x2010,
       0x2010,
       kRecord,
       {"Impedance"},
       {{"Stiffness", kStiffness},
        {"Damping", kDamping},
        {"Stiffness in use", kStiffness},
        {"Damping in use", kDamping}}},
      {0x2011,
       0x2011,
       kRecord,
       {"Impedance for PDOs"},
       {{"Stiffness", kCoarseStiffness, "stiffness"}, {"Damping", kCoarseDamping, "damping"}}},
      {0x2020,
       0x2020,
       kRecord,
       {"Series elastic element"},
       {{"Deflection", kPosition, "deflection"},
        {"Spring torque", kMilliNewtonMetre, "spring_torque"},
        {"Spring constant", kStiffness}}},
      {0x2030,
       0x2030,
       kRecord,
       {"Temperatures"},
       {{"Motor temperature", kDeciCelsius, "motor_temp"},
        {"Driver temperature", kDeciCelsius, "driver_temp"},
        {"Warning limit", kDeciCelsius},
        {"Trip limit", kDeciCelsius}}},
      {0x2031,
       0x2031,
       kRecord,
       {"Temperatures for PDOs"},
       {{"Motor temperature", kCelsius, "motor_temp_i8"}}},
      {0x2032,
       0x2032,
       kRecord,
       {"Supply limits"},
       {{"Lower limit", kMilliVolt}, {"Upper limit", kMilliVolt}}},
      {0x2040, 0x2040, kRecord, {"Position loop gains"}, {{"P gain"}, {"I gain"}, {"D gain"}}},
      {0x2041, 0x2041, kRecord, {"Velocity loop gains"}, {{"P gain"}, {"I gain"}, {"D gain"}}},
      {0x2042, 0x2042, kRecord, {"Torque loop gains"}, {{"P gain"}, {"I gain"}, {"D gain"}}},
      {0x2050, 0x2050, kRecord, {"Cycle counter"}, {{"Counter", kPlain, "counter"}}},
      {0x2060, 0x2060, kVariable, {"User note"}},
      {0x2061,
       0x2061,
       kRecord,
       {"Network time"},
       {{"Milliseconds after midnight"}, {"Days since 1984-01-01"}}},
  };
  return kTable;
}

}  // namespace walkman::device_files
