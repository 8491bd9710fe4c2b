#include "emulator/nodes/cia301/parameter_store.h"

namespace walkman::nodes {
namespace {

constexpr std::uint16_t kStore = 0x1010;
constexpr std::uint16_t kRestore = 0x1011;
constexpr std::uint32_t kSave = 0x65766173;  // "save"
constexpr std::uint32_t kLoad = 0x64616F6C;  // "load"
constexpr std::uint32_t kOnCommand = 1;      // returned by a read: done on command, not by itself

struct Area {
  std::uint16_t first, last;
};
constexpr Area kAreas[] = {{0x1000, 0xFFFF}, {0x1000, 0x1FFF}, {0x2000, 0xFFFF}};

}  // namespace

ParameterStore::ParameterStore(ObjectDictionary& dictionary) : dictionary_(dictionary) {
  for (const std::uint16_t index : {kStore, kRestore}) {
    std::uint8_t sub = 0;
    for (const Area& area : kAreas) {
      auto object = dictionary.object<std::uint32_t>(index, ++sub);
      object.on_write([this, index, area](std::uint32_t signature) -> Refusal {
        if (signature != (index == kStore ? kSave : kLoad)) return SdoAbort::kStore;
        if (index == kStore) {
          dictionary_.store(area.first, area.last);
        } else {
          dictionary_.forget(area.first, area.last);
        }
        return std::nullopt;
      });
      object.on_read([object]() mutable -> Refusal {
        object.set(kOnCommand);
        return std::nullopt;
      });
    }
  }
}

}  // namespace walkman::nodes
