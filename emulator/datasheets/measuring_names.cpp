#include "emulator/datasheets/object_names.h"

namespace walkman::datasheets {

std::span<const ObjectName> measuring_names() {
  using enum ObjectCode;
  using enum Quantity;
  // "Channel {}" is replaced by what the channel measures.
  static const std::vector<ObjectName> kTable = {
      {0x6100, 0x6100, kArray, {"AI input FV", kPlain, "field"}, {}, {"Channel {}", kMeasuredReal}},
      {0x6110, 0x6110, kArray, {"AI sensor type"}, {}, {"Channel {}"}},
      {0x6112, 0x6112, kArray, {"AI operating mode"}, {}, {"Channel {}"}},
      {0x6114, 0x6114, kArray, {"AI ADC sample rate"}, {}, {"Channel {}", kMicroSecond}},
      {0x6124, 0x6124, kArray, {"AI input offset"}, {}, {"Channel {}", kMeasuredReal}},
      {0x6125, 0x6125, kArray, {"AI autozero"}, {}, {"Channel {}"}},
      {0x6126, 0x6126, kArray, {"AI scaling factor"}, {}, {"Channel {}"}},
      {0x6127, 0x6127, kArray, {"AI scaling offset"}, {}, {"Channel {}", kMeasuredReal}},
      {0x6130, 0x6130, kArray, {"AI input PV", kPlain, "real"}, {}, {"Channel {}", kMeasuredReal}},
      {0x6131, 0x6131, kArray, {"AI physical unit PV"}, {}, {"Channel {}"}},
      {0x6132, 0x6132, kArray, {"AI decimal digits PV"}, {}, {"Channel {}"}},
      {0x6133, 0x6133, kArray, {"AI interrupt delta input PV"}, {}, {"Channel {}", kMeasuredReal}},
      {0x6134, 0x6134, kArray, {"AI interrupt lower limit input PV"}, {}, {"Channel {}", kMeasuredReal}},
      {0x6135, 0x6135, kArray, {"AI interrupt upper limit input PV"}, {}, {"Channel {}", kMeasuredReal}},
      {0x6138, 0x6138, kArray, {"AI tare zero"}, {}, {"Channel {}", kMeasuredReal}},
      {0x6139, 0x6139, kArray, {"AI auto tare"}, {}, {"Channel {}"}},
      {0x6140, 0x6140, kArray, {"AI net PV", kPlain, "net"}, {}, {"Channel {}", kMeasuredReal}},
      {0x6148, 0x6148, kArray, {"AI span start"}, {}, {"Channel {}", kMeasuredReal}},
      {0x6149, 0x6149, kArray, {"AI span end"}, {}, {"Channel {}", kMeasuredReal}},
      {0x6150, 0x6150, kArray, {"AI status", kPlain, "status"}, {}, {"Channel {}"}},
      {0x61A0, 0x61A0, kArray, {"AI filter type"}, {}, {"Channel {}"}},
      {0x61A1, 0x61A1, kArray, {"AI filter constant"}, {}, {"Channel {}", kMilliSecond}},
      {0x7100, 0x7100, kArray, {"AI input FV as i16", kPlain, "field"}, {}, {"Channel {}", kMeasuredInteger}},
      {0x7130, 0x7130, kArray, {"AI input PV as i16", kPlain, "pv"}, {}, {"Channel {}", kMeasuredInteger}},
      {0x7140, 0x7140, kArray, {"AI net PV as i16", kPlain, "net"}, {}, {"Channel {}", kMeasuredInteger}},
      {0x8130, 0x8130, kArray, {"AI input PV as i24", kPlain, "pv24"}, {}, {"Channel {}", kMeasuredInteger}},
      {0x9130, 0x9130, kArray, {"AI input PV as i32", kPlain, "pv32"}, {}, {"Channel {}", kMeasuredInteger}},
      {0x9140, 0x9140, kArray, {"AI net PV as i32", kPlain, "net32"}, {}, {"Channel {}", kMeasuredInteger}},
  };
  return kTable;
}

}  // namespace walkman::datasheets
