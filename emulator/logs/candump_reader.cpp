#include "emulator/logs/candump_reader.h"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <stdexcept>
#include <string_view>

#include "emulator/bus/frame_length.h"
#include "emulator/logs/can_log.h"
#include "urdf/reader/text_file.h"

namespace walkman::bus {
namespace {

constexpr char kComment = '#';  // begins a line that is not a frame
// The longest line that a frame can have is 190 characters.
constexpr std::size_t kLongestLine = 255;
constexpr std::size_t kLongestInterfaceName = 15;  // IFNAMSIZ without the terminating zero
constexpr std::uint32_t kLongestIdentifier = 0x1FFFFFFF;
constexpr std::size_t kMostSecondsDigits = 10;  // up to the year 2286; 64-bit nanoseconds overflow in 2262
constexpr std::int64_t kMostSeconds = 9'000'000'000;

struct Malformed {
  std::string what;
};

std::string shown(std::string_view text) {
  std::string out = "'";
  for (const char c : text.substr(0, 40)) out.push_back(c >= ' ' && c <= '~' ? c : '?');
  return out.append(text.size() > 40 ? "...'" : "'");
}

int hex_digit(char c) {
  if (c >= '0' && c <= '9') return c - '0';
  if (c >= 'A' && c <= 'F') return c - 'A' + 10;
  if (c >= 'a' && c <= 'f') return c - 'a' + 10;
  return -1;
}

bool all_digits(std::string_view text) {
  return !text.empty() && std::all_of(text.begin(), text.end(), [](char c) { return c >= '0' && c <= '9'; });
}

/// Removes the next word from the front of the line and returns it.
std::string_view word(std::string_view& line) {
  const std::size_t start = std::min(line.find_first_not_of(' '), line.size());
  line.remove_prefix(start);
  const std::size_t end = std::min(line.find(' '), line.size());
  const std::string_view found = line.substr(0, end);
  line.remove_prefix(end);
  return found;
}

Time parse_time(std::string_view text) {
  const Malformed malformed{"time " + shown(text) + ", expected (seconds.microseconds)"};
  if (text.size() < 3 || text.front() != '(' || text.back() != ')') throw malformed;
  const std::string_view number = text.substr(1, text.size() - 2);
  const std::size_t point = number.find('.');
  if (point == std::string_view::npos) throw malformed;
  const std::string_view seconds = number.substr(0, point);
  const std::string_view fraction = number.substr(point + 1);
  if (!all_digits(seconds) || seconds.size() > kMostSecondsDigits) throw malformed;
  if (!all_digits(fraction) || fraction.size() > 9) throw malformed;
  std::int64_t whole = 0;
  for (const char c : seconds) whole = whole * 10 + (c - '0');
  if (whole > kMostSeconds) throw malformed;
  std::int64_t ns = 0;
  for (std::size_t i = 0; i < 9; ++i) ns = ns * 10 + (i < fraction.size() ? fraction[i] - '0' : 0);
  return Time(whole * 1'000'000'000 + ns);
}

std::uint32_t parse_identifier(std::string_view text, can::Frame& frame) {
  const Malformed malformed{"identifier " + shown(text) + ", expected 3 or 8 hexadecimal digits in range"};
  std::uint32_t id = 0;
  if (text.size() != 3 && text.size() != 8) throw malformed;
  for (const char c : text) {
    if (hex_digit(c) < 0) throw malformed;
    id = id << 4U | static_cast<std::uint32_t>(hex_digit(c));
  }
  frame.error = text.size() == 8 && (id & kErrorFlag) != 0;
  frame.extended = text.size() == 8 && !frame.error;
  if (frame.error) id &= ~kErrorFlag;
  if (id > (text.size() == 3 ? 0x7FFU : kLongestIdentifier)) throw malformed;
  return id;
}

void parse_data(std::string_view text, can::Frame& frame) {
  const std::size_t most = frame.fd ? can::kMaxPayload : 8;
  if (text.size() % 2 != 0) throw Malformed{"data " + shown(text) + ", expected two digits per byte"};
  if (text.size() > 2 * most) {
    throw Malformed{std::to_string(text.size() / 2) + " data bytes, expected at most " +
                    std::to_string(most)};
  }
  for (std::size_t i = 0; i < text.size(); i += 2) {
    const int high = hex_digit(text[i]);
    const int low = hex_digit(text[i + 1]);
    if (high < 0 || low < 0) throw Malformed{"data " + shown(text) + ", expected hexadecimal digits"};
    frame.data[i / 2] = static_cast<std::uint8_t>(high << 4 | low);
  }
  frame.length = static_cast<std::uint8_t>(text.size() / 2);
}

can::Frame parse_frame(std::string_view text) {
  can::Frame frame;
  const std::size_t hash = text.find('#');
  if (hash == std::string_view::npos) {
    throw Malformed{"frame " + shown(text) + ", expected identifier#data"};
  }
  frame.id = parse_identifier(text.substr(0, hash), frame);
  std::string_view data = text.substr(hash + 1);
  if (!data.empty() && data.front() == 'R') {
    data.remove_prefix(1);
    if (frame.error || data.size() > 1 || (!data.empty() && (data.front() < '0' || data.front() > '8'))) {
      throw Malformed{"remote frame " + shown(text) + ", expected R and a length from 0 to 8"};
    }
    frame.remote = true;
    if (!data.empty()) frame.length = static_cast<std::uint8_t>(data.front() - '0');
    return frame;
  }
  if (!data.empty() && data.front() == '#') {
    frame.fd = true;
    if (frame.error || data.size() < 2 || hex_digit(data[1]) < 0) {
      throw Malformed{"FD frame " + shown(text) + ", expected ## and a flags digit before the data"};
    }
    data.remove_prefix(2);
  }
  parse_data(data, frame);
  if (frame.fd && !is_sendable(frame)) {
    throw Malformed{std::to_string(frame.length) +
                    " data bytes, expected a length of CAN FD (0 to 8, 12, 16, 20, 24, 32, 48, 64)"};
  }
  if (frame.error && frame.length != 8) {
    throw Malformed{"error report of " + std::to_string(frame.length) + " bytes, expected 8"};
  }
  return frame;
}

LoggedFrame parse_line(std::string_view line) {
  LoggedFrame out;
  out.stamped.time = parse_time(word(line));
  out.interface_name = word(line);
  if (out.interface_name.empty() || out.interface_name.size() > kLongestInterfaceName) {
    throw Malformed{"interface " + shown(out.interface_name) + ", expected a name of 1 to 15 characters"};
  }
  out.stamped.frame = parse_frame(word(line));
  const std::string_view mark = word(line);
  if (!mark.empty() && mark != "R" && mark != "T") {
    throw Malformed{shown(mark) + " after the frame, expected the end of the line"};
  }
  if (!word(line).empty()) throw Malformed{"additional text after the frame, expected the end of the line"};
  return out;
}

}  // namespace

CandumpReader::CandumpReader(std::filesystem::path file) : file_(std::move(file)) {
  require_regular_file(file_);
  stream_.open(file_, std::ios::binary);
  if (!stream_) {
    throw std::runtime_error(file_.string() + ": cannot be opened (" + std::strerror(errno) +
                             "), expected a log as candump -L writes it");
  }
}

void CandumpReader::fail(const std::string& what) const {
  throw std::runtime_error(file_.string() + ":" + std::to_string(number_) + ": " + what);
}

bool CandumpReader::read_line() {
  line_.clear();
  ++number_;
  int c = 0;
  while ((c = stream_.get()) != std::ifstream::traits_type::eof() && c != '\n') {
    if (line_.size() == kLongestLine) {
      if (line_.front() == kComment) continue;
      fail("line of more than " + std::to_string(kLongestLine) + " characters, expected a frame");
    }
    line_.push_back(static_cast<char>(c));
  }
  if (stream_.bad()) fail("cannot be read, expected a log as candump -L writes it");
  if (!line_.empty() && line_.back() == '\r') line_.pop_back();
  return c != std::ifstream::traits_type::eof() || !line_.empty();
}

bool CandumpReader::next(LoggedFrame& out) {
  while (read_line()) {
    if (line_.find_first_not_of(' ') == std::string::npos || line_.front() == kComment) continue;
    try {
      out = parse_line(line_);
    } catch (const Malformed& malformed) {
      fail(malformed.what);
    }
    return true;
  }
  return false;
}

}  // namespace walkman::bus
