#pragma once

#include <cstdint>
#include <string>

#include "emulator/nodes/cia301/object_dictionary.h"

namespace walkman::datasheets {

/// What one count of an object's value stands for.
enum class Quantity : std::uint8_t {
  kPlain,                ///< words, counters, codes: no unit
  kPosition,             ///< urad
  kVelocity,             ///< urad/s
  kAcceleration,         ///< urad/s^2
  kTorquePerMille,       ///< per mille of the rated torque 6076h
  kCurrentPerMille,      ///< per mille of the rated current 6075h
  kMilliNewtonMetre,     ///< mN m
  kMilliAmpere,          ///< mA
  kMilliVolt,            ///< mV
  kMilliSecond,          ///< ms
  kMicroSecond,          ///< us
  kHundredMicroSeconds,  ///< 100 us
  kDeciCelsius,          ///< 0.1 degC
  kCelsius,              ///< degC
  kStiffness,            ///< mN m/rad
  kDamping,              ///< mN m s/rad
  kCoarseStiffness,      ///< 0.1 N m/rad
  kCoarseDamping,        ///< 0.01 N m s/rad
  kTorqueSlope,          ///< per mille of the rated torque a second
  kMeasuredReal,         ///< CiA 404 value as REAL32, in the unit that 6131h names
  kMeasuredInteger,      ///< CiA 404 value as integer: 6131h with the decimal digits of 6132h
};

/// A value in SI (degC for temperatures) is `raw * factor` in `text`, which is ASCII; empty for no unit.
struct WireUnit {
  std::string text;
  double factor = 1;
};

/// The unit of the object at `address` of a device. Rated values, units and decimal digits that it depends on
/// are read from the device's dictionary; where they are missing the value is without unit.
[[nodiscard]] WireUnit wire_unit(const nodes::ObjectDictionary& dictionary, nodes::ObjectAddress address);

/// Name of a CiA 303-2 unit code (prefix exponent, numerator, denominator) and the factor of its prefix; an
/// empty text for a code not known here.
[[nodiscard]] WireUnit unit_of_code(std::uint32_t code);

}  // namespace walkman::datasheets
