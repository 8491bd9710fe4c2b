#include "emulator/logs/can_log.h"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <stdexcept>

#include "emulator/logs/candump_log.h"
#include "emulator/logs/pcapng_log.h"
#include "urdf/reader/text_file.h"

namespace walkman::bus {
namespace {

constexpr std::size_t kBatchReserve = 4096;
constexpr std::size_t kFileBuffer = 1 << 18;  // a run writes a megabyte and more per emulated second

}  // namespace

CanLog::CanLog(std::filesystem::path file) : file_(std::move(file)), file_buffer_(kFileBuffer) {
  require_regular_output(file_);
  stream_.rdbuf()->pubsetbuf(file_buffer_.data(), static_cast<std::streamsize>(file_buffer_.size()));
  stream_.open(file_, std::ios::binary);
  if (!stream_) {
    throw std::runtime_error(file_.string() + ": cannot be created (" + std::strerror(errno) +
                             "), expected a writable path for the CAN log");
  }
  batch_.reserve(kBatchReserve);
  order_.reserve(kBatchReserve);
}

void CanLog::commit() {
  order_.clear();
  for (std::size_t i = 0; i < batch_.size(); ++i) order_.emplace_back(batch_[i].frame.time, i);
  std::sort(order_.begin(), order_.end());
  for (const auto& [when, i] : order_) put(batch_[i].interface_name, batch_[i].frame);
  batch_.clear();
}

void CanLog::flush() {
  commit();
  stream_.flush();
  if (!stream_)
    throw std::runtime_error(file_.string() +
                             ": CAN log could not be written completely, expected space on the device");
}

std::unique_ptr<CanLog> open_can_log(const std::filesystem::path& file, std::string_view note) {
  if (file.extension() == ".log") return std::make_unique<CandumpLog>(file, note);
  if (file.extension() == ".pcapng") return std::make_unique<PcapngLog>(file, note);
  throw std::runtime_error(file.string() +
                           ": unknown kind of CAN log, expected a name that ends in .log (candump) or "
                           ".pcapng (Wireshark)");
}

}  // namespace walkman::bus
