#include "emulator/gateways/slcan_adapter.h"

#include <cctype>

#include "emulator/gateways/slcan_protocol.h"

namespace walkman::gateways {

namespace {

/// Kept free of frames, so that a peer that is too slow for the bus still gets its answers.
constexpr std::size_t kAnswerRoom = 512;

constexpr std::uint8_t kReceiveQueueFull = 0x01;
constexpr std::uint8_t kTransmitQueueFull = 0x02;
constexpr std::uint8_t kErrorWarning = 0x04;
constexpr std::uint8_t kDataOverrun = 0x08;
constexpr std::uint8_t kErrorPassive = 0x20;
constexpr std::uint8_t kBusError = 0x80;

/// S7 is 800 kbit/s with Lawicel's adapters and 750 kbit/s with some others.
bool is_rate(char code, std::uint32_t bit_rate) noexcept {
  constexpr std::array<std::uint32_t, 9> kRates = {10'000,  20'000,  50'000,  100'000,  125'000,
                                                   250'000, 500'000, 800'000, 1'000'000};
  if (code < '0' || code > '8') return false;
  return kRates[static_cast<std::size_t>(code - '0')] == bit_rate || (code == '7' && bit_rate == 750'000);
}

/// Whether the frame reports that errors have brought the controller to warning, passive or bus-off
/// (linux/can/error.h).
bool is_bus_error(const can::Frame& frame) noexcept {
  return frame.error && ((frame.id & 0x040) != 0 || ((frame.id & 0x004) != 0 && (frame.data[1] & 0x3C) != 0));
}

}  // namespace

void SlcanAdapter::take(std::string_view input) noexcept {
  for (const char c : input) {
    if (c == '\r') {
      if (size_ > command_.size()) {
        ++counters_.errors;
        answer("\a");
      } else {
        execute({command_.data(), size_});
      }
      size_ = 0;
    } else if (c != '\n') {
      if (size_ < command_.size()) command_[size_] = c;
      if (size_ <= command_.size()) ++size_;
    }
  }
}

void SlcanAdapter::execute(std::string_view command) noexcept {
  // Tools send empty commands to clear what an adapter may still hold from an earlier session.
  if (command.empty()) {
    answer("\r");
    return;
  }
  bool done = false;
  switch (command.front()) {
    case 't':
    case 'r':
    case 'T':
    case 'R':
      if (transmit(command)) {
        answer(command.front() == 't' || command.front() == 'r' ? "z\r" : "Z\r");
        return;
      }
      break;
    case 'V':
    case 'N':
      if (command.size() != 1) break;
      identify(command.front());
      return;
    case 'F':
      if (command.size() != 1 || channel_ == Channel::kClosed) break;
      report_flags();
      return;
    default:
      done = set_up(command);
  }
  if (!done) ++counters_.errors;
  answer(done ? "\r" : "\a");
}

bool SlcanAdapter::set_up(std::string_view command) noexcept {
  const char kind = command.front();
  if (kind == 's') return channel_ == Channel::kClosed;
  if (command == "C") {
    channel_ = Channel::kClosed;
    return true;
  }
  if (command == "O") return open(Channel::kOpen);
  if (command == "L") return open(Channel::kListening);
  if (command == "Z0" || command == "Z1") {
    stamps_ = command == "Z1";
    return true;
  }
  return kind == 'S' && command.size() == 2 && channel_ == Channel::kClosed &&
         is_rate(command[1], bus_.bit_rate());
}

bool SlcanAdapter::open(Channel channel) noexcept {
  if (channel_ != Channel::kClosed) return false;
  if (controller_ == nullptr) {
    controller_ = &bus_.add_port();
    controller_->configure({.reports = bus::ErrorReports::kStates});
  }
  controller_->restart();
  forward();  // discards what came while it was closed
  overflows_ = controller_->receive_overflows();
  flags_ = 0;
  channel_ = channel;
  return true;
}

bool SlcanAdapter::transmit(std::string_view command) noexcept {
  can::Frame frame;
  if (channel_ != Channel::kOpen || !read_slcan(command, frame)) return false;
  const can::SendResult result = controller_->send(frame);
  if (result == can::SendResult::kQueued) {
    ++counters_.sent;
    return true;
  }
  ++counters_.refused;
  if (result == can::SendResult::kQueueFull) flags_ |= kTransmitQueueFull;
  return false;
}

void SlcanAdapter::identify(char command) noexcept {
  TextLine line;
  line.add(command);
  if (command == 'V') {
    line.add("0101");  // hardware 01, software 01
  } else {
    for (std::size_t i = 0; i < 4; ++i) {
      const int c = i < bus_.name().size() ? static_cast<unsigned char>(bus_.name()[i]) : '0';
      line.add(std::isalnum(c) != 0 ? static_cast<char>(std::toupper(c)) : '0');
    }
  }
  line.add('\r');
  answer(line.text());
}

void SlcanAdapter::report_flags() noexcept {
  std::uint8_t flags = flags_;
  flags_ = 0;
  const can::LinkState link = controller_->link();
  if (link == can::LinkState::kWarning) flags |= kErrorWarning;
  if (link == can::LinkState::kPassive) flags |= kErrorWarning | kErrorPassive;
  if (link == can::LinkState::kBusOff) flags |= kErrorWarning | kErrorPassive | kBusError;
  TextLine line;
  line.add('F');
  line.add_hex(flags, 2);
  line.add('\r');
  answer(line.text());
}

void SlcanAdapter::forward() noexcept {
  if (controller_ == nullptr) return;
  can::StampedFrame frame;
  while (controller_->receive(frame)) {
    if (channel_ == Channel::kClosed) continue;
    TextLine line;
    if (!write_slcan(frame, stamps_, line)) {
      if (is_bus_error(frame.frame)) flags_ |= kBusError;
      ++counters_.skipped;
    } else if (outgoing_.room() < line.text().size() + kAnswerRoom || !outgoing_.push(line.text())) {
      flags_ |= kReceiveQueueFull | kDataOverrun;
      ++counters_.dropped;
    } else {
      ++counters_.received;
    }
  }
  const std::uint64_t lost = controller_->receive_overflows() - overflows_;
  overflows_ += lost;
  if (channel_ == Channel::kClosed || lost == 0) return;
  flags_ |= kReceiveQueueFull | kDataOverrun;
  counters_.dropped += lost;
}

void SlcanAdapter::reset() noexcept {
  channel_ = Channel::kClosed;
  stamps_ = false;
  flags_ = 0;
  size_ = 0;
  outgoing_.clear();
}

}  // namespace walkman::gateways
