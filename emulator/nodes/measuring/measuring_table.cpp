#include "emulator/nodes/measuring/measuring_table.h"

#include "drivers/canopen/objects.h"

namespace walkman::nodes {

namespace object = canopen::object;

namespace {

using enum Quantity;
using u8 = std::uint8_t;
using u16 = std::uint16_t;
using u32 = std::uint32_t;

using Rows = std::vector<ObjectRow>;

ObjectRow channels(std::uint16_t index, std::string_view name, const EntryRow& each) {
  return array_of(index, name, each, 0);
}

template <typename T>
EntryRow fixed() {
  return read_only<T>(kChannelName).of_the_device();
}

/// A value in the unit of 6131h.
EntryRow real() { return read_only<float>(kChannelName).of_the_device().in(kMeasuredReal); }
EntryRow real_setting(float factory = 0) {
  return read_write<float>(kChannelName, factory).in(kMeasuredReal);
}

template <typename T>
EntryRow measured() {
  return read_only<T>(kChannelName).pdo().in(std::is_same_v<T, float> ? kMeasuredReal : kMeasuredInteger);
}

/// The word that names the object in signal names.
ObjectRow called(ObjectRow row, std::string_view word) {
  row.zero.symbol = word;
  return row;
}

}  // namespace

ObjectTable channel_table() {
  static const Rows kRows{
      channels(0x6110, "AI sensor type", fixed<u16>())
          .means("10000 force, 10001 torque, 10501 specific force, 10401 angular velocity, 10601 orientation "
                 "(the "
                 "manufacturer's range)"),
      channels(0x6112, "AI operating mode", read_write<u8>(kChannelName, 1).within(0, 1))
          .means("1 on, 0 off"),
      channels(0x6114, "AI ADC sample rate", fixed<u32>().in(kMicroSecond)).means("the sample period; 1000"),
      called(channels(object::kProcessValueReal, "AI input PV", measured<float>()), "real")
          .means("process value 6126 · 6100 + 6127 + 6124 − 6138"),
      channels(0x6131, "AI physical unit PV", fixed<u32>()).means("CiA 303-2"),
      channels(0x6133, "AI interrupt delta input PV", real_setting())
          .means("an event when the process value has moved by more; 0 = none"),
      channels(0x6134, "AI interrupt lower limit input PV", real_setting().of_the_device())
          .means("an event when the process value crosses it; by default the measuring range"),
      channels(0x6135, "AI interrupt upper limit input PV", real_setting().of_the_device())
          .means("an event when the process value crosses it; by default the measuring range"),
      channels(0x6148, "AI span start", real()).means("measuring range"),
      channels(0x6149, "AI span end", real()),
      called(channels(object::kMeasuringStatus, "AI status", read_only<u8>(kChannelName, 1).pdo()), "status")
          .means("bit 0 invalid, 1 positive, 2 negative overload; :1 has the bits of all channels"),
      called(channels(object::kProcessValueInt16, "AI input PV as i16", measured<std::int16_t>()), "pv")
          .means("the process value in wire units"),
      called(channels(0x9130, "AI input PV as i32", measured<std::int32_t>()), "pv32")
          .means("the process value in wire units"),
  };
  return kRows;
}

ObjectTable digits_table() {
  static const Rows kRows{
      channels(object::kDecimalDigits, "AI decimal digits PV", fixed<u8>()).means("of 7130h and 9130h")};
  return kRows;
}

ObjectTable adjustment_table() {
  static const Rows kRows{
      called(channels(0x6100, "AI input FV", measured<float>()), "field")
          .means("field value: the reading after range, resolution and filter"),
      channels(0x6124, "AI input offset", real_setting()),
      channels(0x6125, "AI autozero", write_only<u32>(kChannelName))
          .means("\"zero\" 6F72657Ah: sets 6124h so that the process value is 0"),
      channels(0x6126, "AI scaling factor", read_write<float>(kChannelName, 1)),
      channels(0x6127, "AI scaling offset", real_setting()),
      channels(object::kTare, "AI tare zero", real_setting()),
      channels(object::kAutoTare, "AI auto tare", write_only<u32>(kChannelName))
          .means("\"tara\" 61726174h tares"),
      called(channels(0x6140, "AI net PV", measured<float>()), "net").means("the same as 6130h"),
      channels(0x61A0, "AI filter type", read_write<u8>(kChannelName).within(0, 2))
          .means("0 none, 1 first-order low-pass, 2 two of them in series"),
      channels(0x61A1, "AI filter constant", read_write<u16>(kChannelName, 10).in(kMilliSecond)),
      called(channels(0x7100, "AI input FV as i16", measured<std::int16_t>()), "field")
          .means("6100h in wire units"),
  };
  return kRows;
}

ObjectTable sample_counter_table() {
  static const Rows kRows{
      record(object::kCycleCounter, "Cycle counter",
             {read_only<u16>("Counter").pdo().called("counter").means("samples since boot")})};
  return kRows;
}

ObjectTable sensor_temperature_table() {
  static const Rows kRows{record(object::kSensorTemperature, "Sensor temperatures",
                                 {read_only<std::int16_t>("Sensor temperature")
                                      .of_the_device()
                                      .pdo()
                                      .in(kDeciCelsius)
                                      .called("sensor_temp")})};
  return kRows;
}

}  // namespace walkman::nodes
