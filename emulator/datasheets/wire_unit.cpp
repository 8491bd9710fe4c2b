#include "emulator/datasheets/wire_unit.h"

#include <cmath>
#include <string_view>

#include "emulator/nodes/measuring/inertial_node.h"

namespace walkman::datasheets {
namespace {

constexpr std::uint16_t kRatedCurrent = 0x6075;
constexpr std::uint16_t kRatedTorque = 0x6076;
constexpr std::uint16_t kSensorType = 0x6110;
constexpr std::uint16_t kPhysicalUnit = 0x6131;
constexpr std::uint16_t kDecimalDigits = 0x6132;

/// Symbols of CiA 303-2; the joule's code is used for the newton metre, which has the same dimension.
std::string_view symbol_of(unsigned code) {
  switch (code) {
    case 0x01:
      return "m";
    case 0x02:
      return "kg";
    case 0x03:
      return "s";
    case 0x04:
      return "A";
    case 0x10:
      return "rad";
    case 0x20:
      return "Hz";
    case 0x21:
      return "N";
    case 0x22:
      return "Pa";
    case 0x23:
      return "Nm";
    case 0x26:
      return "V";
    case 0x2D:
      return "degC";
    case 0x57:
      return "s^2";
    default:
      return "";
  }
}

/// Per mille of a rating that the dictionary gives in thousandths of `text`.
WireUnit per_mille(const nodes::ObjectDictionary& dictionary, std::uint16_t rating, const char* text) {
  const nodes::Entry* entry = dictionary.find(rating, 0);
  if (entry == nullptr) return {"", nodes::kMilli};
  return {text, static_cast<double>(entry->default_raw) / 1e6};
}

WireUnit measured(const nodes::ObjectDictionary& dictionary, std::uint8_t channel, bool integer) {
  const nodes::Entry* sensor = dictionary.find(kSensorType, channel);
  if (sensor != nullptr && sensor->default_raw == nodes::kOrientationSensor)
    return {"", integer ? nodes::kQuaternionUnit : 1};
  const nodes::Entry* unit = dictionary.find(kPhysicalUnit, channel);
  const nodes::Entry* digits = dictionary.find(kDecimalDigits, channel);
  WireUnit result = unit == nullptr ? WireUnit{} : unit_of_code(unit->default_raw);
  if (integer && digits != nullptr)
    result.factor *= std::pow(10.0, -static_cast<double>(digits->default_raw));
  return result;
}

}  // namespace

WireUnit unit_of_code(std::uint32_t code) {
  const auto exponent = static_cast<std::int8_t>(code >> 24U);
  const std::string_view numerator = symbol_of(code >> 16U & 0xFFU);
  const unsigned denominator = code >> 8U & 0xFFU;
  if (numerator.empty() || (denominator != 0 && symbol_of(denominator).empty())) return {};
  WireUnit unit{std::string(numerator), std::pow(10.0, exponent)};
  if (denominator != 0) unit.text.append("/").append(symbol_of(denominator));
  return unit;
}

WireUnit wire_unit(const nodes::ObjectDictionary& dictionary, const nodes::Entry& entry) {
  using nodes::Quantity;
  switch (entry.row->quantity) {
    case Quantity::kPlain:
      return {};
    case Quantity::kPosition:
      return {"rad", nodes::kMicro};
    case Quantity::kVelocity:
      return {"rad/s", nodes::kMicro};
    case Quantity::kAcceleration:
      return {"rad/s^2", nodes::kMicro};
    case Quantity::kTorquePerMille:
      return per_mille(dictionary, kRatedTorque, "Nm");
    case Quantity::kTorqueSlope:
      return per_mille(dictionary, kRatedTorque, "Nm/s");
    case Quantity::kCurrentPerMille:
      return per_mille(dictionary, kRatedCurrent, "A");
    case Quantity::kMilliNewtonMetre:
      return {"Nm", nodes::kMilli};
    case Quantity::kMilliAmpere:
      return {"A", nodes::kMilli};
    case Quantity::kMilliVolt:
      return {"V", nodes::kMilli};
    case Quantity::kMilliSecond:
      return {"s", nodes::kMilli};
    case Quantity::kMicroSecond:
      return {"s", nodes::kMicro};
    case Quantity::kHundredMicroSeconds:
      return {"s", 1e-4};
    case Quantity::kDeciCelsius:
      return {"degC", nodes::kDeci};
    case Quantity::kCelsius:
      return {"degC", 1};
    case Quantity::kStiffness:
      return {"Nm/rad", nodes::kMilli};
    case Quantity::kDamping:
      return {"Nms/rad", nodes::kMilli};
    case Quantity::kCoarseStiffness:
      return {"Nm/rad", 0.1};
    case Quantity::kCoarseDamping:
      return {"Nms/rad", 0.01};
    case Quantity::kMeasuredReal:
      return measured(dictionary, entry.address.sub, false);
    case Quantity::kMeasuredInteger:
      return measured(dictionary, entry.address.sub, true);
  }
  return {};
}

}  // namespace walkman::datasheets
