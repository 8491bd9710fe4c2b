#include "emulator/logs/state_log.h"

#include <array>
#include <cerrno>
#include <cinttypes>
#include <cstdio>
#include <cstring>
#include <stdexcept>

#include "emulator/nodes/cia301/canopen_slave.h"

namespace walkman::datasheets {
namespace {

/// The raw value interpreted according to its type.
std::int64_t number(const nodes::Entry& entry) noexcept {
  switch (entry.type) {
    case nodes::DataType::kInteger8:
      return nodes::from_raw<std::int8_t>(entry.raw);
    case nodes::DataType::kInteger16:
      return nodes::from_raw<std::int16_t>(entry.raw);
    case nodes::DataType::kInteger32:
      return nodes::from_raw<std::int32_t>(entry.raw);
    default:
      return entry.raw;
  }
}

}  // namespace

StateLog::StateLog(std::filesystem::path file, std::string_view note)
    : file_(std::move(file)), stream_(file_) {
  if (!stream_) {
    throw std::runtime_error(file_.string() + ": cannot be created (" + std::strerror(errno) +
                             "), expected a writable path for the state log");
  }
  if (!note.empty()) stream_ << "# " << note << '\n';
  stream_ << "time,node,cob_id,index,sub,raw\n";
}

void StateLog::watch(const bus::CanBus& bus) {
  for (bus::Participant* participant : bus.participants()) {
    auto* node = dynamic_cast<nodes::CanopenSlave*>(participant);
    if (node == nullptr) continue;
    const int id = node->node_id();
    node->observe_pdos([this, id](std::uint32_t cob_id, const nodes::Entry& entry, Time now) {
      std::array<char, 96> row;
      const int n =
          std::snprintf(row.data(), row.size(), "%" PRId64 ".%09" PRId64 ",%d,0x%03X,0x%04X,%u,%" PRId64 "\n",
                        now.count() / 1'000'000'000, now.count() % 1'000'000'000, id, cob_id,
                        entry.address.index, entry.address.sub, number(entry));
      stream_.write(row.data(), n);
    });
  }
}

void StateLog::flush() {
  stream_.flush();
  if (!stream_)
    throw std::runtime_error(file_.string() +
                             ": state log could not be written completely, expected space on the device");
}

}  // namespace walkman::datasheets
