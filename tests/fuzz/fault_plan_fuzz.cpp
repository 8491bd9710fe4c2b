// A fault plan in YAML, and a fault in words as on the command line and on the control socket.

#include <sstream>
#include <string>
#include <vector>

#include "emulator/faults/fault_plan.h"
#include "tests/fuzz/injection_checks.h"
#include "tests/fuzz/input.h"
#include "tests/fuzz/input_file.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace walkman;
  static fuzz::InputFile file("plan.yaml");
  file.write({data, size});
  file.read_or_refuse([] {
    for (const faults::Injection& injection : faults::load_fault_plan(file.path()))
      fuzz::require_in_range(injection);
  });
  std::istringstream text(std::string(reinterpret_cast<const char*>(data), size));
  std::vector<std::string> words;
  for (std::string word; text >> word;) words.push_back(word);
  try {
    fuzz::require_in_range(faults::parse_fault(words));
  } catch (const std::runtime_error& complaint) {
    fuzz::require(*complaint.what() != '\0', "a complaint has words");
  }
  return 0;
}
