#pragma once

#include <cstdint>

#include "emulator/nodes/cia301/object_dictionary.h"

namespace walkman::nodes {

/// Store and restore (CiA 301, 7.5.2.13 and 7.5.2.14), objects 1010h and 1011h: sub 1 all parameters, 2 the
/// communication area 1000h-1FFFh, 3 the application area 2000h-FFFFh. Triggered by writing "save" or "load";
/// any other signature is refused with 0800 0020. Restored values take effect with the next reset.
class ParameterStore {
 public:
  explicit ParameterStore(ObjectDictionary& dictionary);
  ParameterStore(const ParameterStore&) = delete;
  ParameterStore& operator=(const ParameterStore&) = delete;

 private:
  ObjectDictionary& dictionary_;
};

}  // namespace walkman::nodes
