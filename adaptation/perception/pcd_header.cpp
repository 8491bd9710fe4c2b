#include <algorithm>
#include <array>
#include <charconv>
#include <cstring>
#include <fstream>
#include <sstream>
#include <stdexcept>
#include <string_view>
#include <vector>

#include "adaptation/perception/pcd.h"

namespace walkman::perception {
namespace {

constexpr std::size_t kMostPoints = std::size_t{1} << 26;
constexpr std::size_t kMostHeaderLines = 64;
constexpr std::size_t kMostFields = 64;

class HeaderReader {
 public:
  explicit HeaderReader(const std::filesystem::path& file) : file_(file), in_(file, std::ios::binary) {
    std::error_code error;
    if (!in_ || std::filesystem::is_directory(file, error)) fail("cannot be read");
    size_ = std::filesystem::file_size(file, error);
    if (error) fail("is not a regular file");
    if (size_ == 0) fail("is empty, expected a PCD header");
  }

  PcdHeader read() {
    while (header_.data.empty()) read_line();
    check_fields();
    check_counts();
    header_.body_offset = static_cast<std::size_t>(in_.tellg());
    check_body();
    return header_;
  }

 private:
  [[noreturn]] void fail(const std::string& reason) const {
    const std::string where = line_ == 0 ? file_.string() : file_.string() + ":" + std::to_string(line_);
    throw std::runtime_error(where + ": " + reason);
  }

  void read_line() {
    std::string text;
    if (++line_ > kMostHeaderLines)
      fail("no DATA line within the first " + std::to_string(kMostHeaderLines) + " lines");
    char c = 0;
    while (in_.get(c) && c != '\n') {
      if (text.size() > 4096) fail("a header line longer than 4096 bytes; not a PCD file");
      text.push_back(c);
    }
    if (!in_) fail("ends within the header, expected a DATA line");
    std::istringstream words(text);
    std::string key;
    if (!(words >> key) || key.front() == '#') return;
    std::vector<std::string> values;
    for (std::string word; words >> word;) values.push_back(word);
    take(key, values);
  }

  void take(const std::string& key, const std::vector<std::string>& values) {
    static const std::array<std::string_view, 11> kKeys{"VERSION",   "FIELDS", "COLUMNS", "TYPE",
                                                        "SIZE",      "COUNT",  "WIDTH",   "HEIGHT",
                                                        "VIEWPOINT", "POINTS", "DATA"};
    if (std::find(kKeys.begin(), kKeys.end(), key) == kKeys.end())
      fail("unknown header entry '" + key.substr(0, 40) + "'; not a PCD file");
    if (values.empty()) fail(key + " without a value");
    if (values.size() > kMostFields) fail(key + " with more than " + std::to_string(kMostFields) + " values");
    if (key == "FIELDS" || key == "COLUMNS") {
      fields_ = values;
    } else if (key == "TYPE") {
      types_ = values;
    } else if (key == "SIZE") {
      sizes_ = numbers(key, values, 8);
    } else if (key == "COUNT") {
      counts_ = numbers(key, values, 1U << 16U);
    } else if (key == "WIDTH") {
      header_.width = numbers(key, values, kMostPoints).front();
    } else if (key == "HEIGHT") {
      header_.height = numbers(key, values, kMostPoints).front();
    } else if (key == "POINTS") {
      header_.points = numbers(key, values, kMostPoints).front();
      has_points_ = true;
    } else if (key == "DATA") {
      if (values.front() != "ascii" && values.front() != "binary" && values.front() != "binary_compressed")
        fail("DATA '" + values.front() + "', expected ascii, binary or binary_compressed");
      header_.data = values.front();
    }
  }

  std::vector<std::size_t> numbers(const std::string& key, const std::vector<std::string>& values,
                                   std::size_t highest) const {
    std::vector<std::size_t> out;
    for (const auto& text : values) {
      std::size_t v = 0;
      const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), v);
      if (error != std::errc{} || end != text.data() + text.size() || v > highest)
        fail(key + " '" + text.substr(0, 40) + "', expected an integer from 0 to " + std::to_string(highest));
      out.push_back(v);
    }
    return out;
  }

  void check_fields() {
    if (fields_.empty()) fail("no FIELDS line before DATA");
    if (counts_.empty()) counts_.assign(fields_.size(), 1);
    if (sizes_.size() != fields_.size() || types_.size() != fields_.size() ||
        counts_.size() != fields_.size())
      fail("FIELDS, SIZE, TYPE and COUNT differ in length");
    for (std::size_t i = 0; i < fields_.size(); ++i) {
      if (counts_[i] == 0) fail("COUNT 0 of field '" + fields_[i] + "'");
      header_.point_bytes += sizes_[i] * counts_[i];
      values_per_point_ += counts_[i];
    }
    for (const char* axis : {"x", "y", "z"}) {
      const auto at = std::find(fields_.begin(), fields_.end(), axis);
      if (at == fields_.end()) fail(std::string("no field '") + axis + "', expected x, y and z");
      const auto i = static_cast<std::size_t>(at - fields_.begin());
      if (sizes_[i] != 4 || types_[i] != "F" || counts_[i] != 1)
        fail(std::string("field '") + axis + "' is not one 4-byte float");
    }
  }

  void check_counts() {
    // Version 0.6 and before may leave WIDTH and HEIGHT out.
    if (header_.width == 0 && header_.height == 0 && has_points_) header_.width = header_.points;
    if (header_.height == 0) header_.height = 1;
    if (header_.width == 0) fail("no points");
    if (header_.width > kMostPoints / header_.height)
      fail("WIDTH " + std::to_string(header_.width) + " times HEIGHT " + std::to_string(header_.height) +
           " is more than " + std::to_string(kMostPoints) + " points");
    if (!has_points_) header_.points = header_.width * header_.height;
    if (header_.width * header_.height != header_.points)
      fail("POINTS " + std::to_string(header_.points) + " is not WIDTH " + std::to_string(header_.width) +
           " times HEIGHT " + std::to_string(header_.height));
  }

  void check_body() {
    const std::uintmax_t present = size_ - header_.body_offset;
    std::uintmax_t needed = 0;
    if (header_.data == "binary") {
      needed = std::uintmax_t{header_.points} * header_.point_bytes;
    } else if (header_.data == "binary_compressed") {
      std::array<std::uint32_t, 2>
          sizes{};  // compressed, uncompressed; little-endian as on every supported host
      std::array<char, 8> bytes{};
      if (!in_.read(bytes.data(), bytes.size())) fail("ends before the sizes of the compressed points");
      std::memcpy(sizes.data(), bytes.data(), bytes.size());
      if (sizes[1] != std::uintmax_t{header_.points} * header_.point_bytes)
        fail("promises " + std::to_string(sizes[1]) + " bytes of points, expected " +
             std::to_string(header_.points * header_.point_bytes));
      needed = 8 + std::uintmax_t{sizes[0]};
    } else {
      needed =
          std::uintmax_t{header_.points} * values_per_point_ * 2 - 1;  // one digit and one separator each
    }
    if (present < needed)
      fail("truncated: " + std::to_string(present) + " bytes of points, expected " +
           (header_.data == "ascii" ? "at least " : "") + std::to_string(needed));
    if (header_.data == "ascii") check_ascii();
  }

  void check_ascii() {
    std::string text;
    std::size_t rows = 0;
    while (rows < header_.points && std::getline(in_, text)) {
      ++line_;
      std::size_t words = 0;
      bool inside = false;
      for (const char c : text) {
        const bool blank = c == ' ' || c == '\t' || c == '\r';
        words += !blank && !inside ? 1 : 0;
        inside = !blank;
      }
      if (words == 0) continue;
      if (words != values_per_point_)
        fail(std::to_string(words) + " values in a point, expected " + std::to_string(values_per_point_));
      ++rows;
    }
    if (rows < header_.points)
      fail("truncated: " + std::to_string(rows) + " points, expected " + std::to_string(header_.points));
  }

  const std::filesystem::path& file_;
  std::ifstream in_;
  std::uintmax_t size_ = 0;
  std::size_t line_ = 0;
  std::vector<std::string> fields_, types_;
  std::vector<std::size_t> sizes_, counts_;
  std::size_t values_per_point_ = 0;
  bool has_points_ = false;
  PcdHeader header_;
};

}  // namespace

PcdHeader read_pcd_header(const std::filesystem::path& file) { return HeaderReader(file).read(); }

}  // namespace walkman::perception
