#include "adaptation/perception/pcd.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstring>
#include <fstream>
#include <limits>
#include <sstream>
#include <stdexcept>
#include <string_view>

#include <pcl/console/print.h>
#include <pcl/io/lzf.h>
#include <pcl/io/pcd_io.h>
#include <pcl/point_types.h>

namespace walkman::perception {
namespace {

constexpr std::size_t kMostPoints = std::size_t{1} << 26;
constexpr std::size_t kMostHeaderLines = 64;
constexpr std::size_t kMostFields = 64;
// LZF's best compression: three bytes that encode a repetition of 264.
constexpr std::uintmax_t kMostCompression = 88;
constexpr double kFarthest = 1e6;       // m, coordinate of a viewpoint
constexpr double kSmallestNorm = 1e-6;  // of the viewpoint's quaternion

/// Contents of a PCD file's header. Offsets and lengths are per point.
struct PcdHeader {
  std::size_t width = 0, height = 0, points = 0;
  std::size_t point_bytes = 0;                             // in a binary body
  std::array<std::size_t, 3> byte_offset{};                // of x, y and z, binary
  std::size_t values = 0;                                  // in an ASCII body
  std::array<std::size_t, 3> column{};                     // of x, y and z, ASCII
  Eigen::Isometry3d X_FC = Eigen::Isometry3d::Identity();  // pose of the sensor
  std::string data;                                        // "ascii", "binary" or "binary_compressed"
};

// Deviation of a column's points from a common x/z, and of a row's from a common y/z, in the frame of a
// sensor at X_FC: the mean spread within the columns and rows relative to that of all points. 1 means that it
// is not a pinhole image.
double spread_of_rays(const camera::OrganizedCloud& cloud, const Eigen::Isometry3d& X_FC) {
  constexpr int kLines = 32;
  const Eigen::Isometry3d X_CF = X_FC.inverse();
  double within = 0, all = 0;
  for (const int axis : {0, 1}) {
    const int lines = axis == 0 ? cloud.width : cloud.height, along = axis == 0 ? cloud.height : cloud.width;
    double total = 0, total_square = 0, count = 0;
    for (int i = 0; i < kLines; ++i) {
      const int line = lines * i / kLines;
      double sum = 0, square = 0, n = 0;
      for (int j = 0; j < along; j += std::max(1, along / 128)) {
        const Eigen::Vector3f& point = axis == 0 ? cloud.at(line, j) : cloud.at(j, line);
        const Eigen::Vector3d p = X_CF * point.cast<double>();
        if (!(p.z() > 1e-3)) continue;  // also skips NaN
        const double tangent = p[axis] / p.z();
        sum += tangent;
        square += tangent * tangent;
        ++n;
      }
      if (n < 2) continue;
      within += square - sum * sum / n;
      total += sum;
      total_square += square;
      count += n;
    }
    if (count < 2) return 1;
    all += total_square - total * total / count;
  }
  return all > 0 ? within / all : 1;
}

// Returns whether an organized cloud's coordinates are already in the sensor's frame although its viewpoint
// places the sensor elsewhere.
bool in_sensor_frame(const camera::OrganizedCloud& cloud, const Eigen::Isometry3d& X_FC) {
  constexpr double kStraight = 1e-3;
  if (cloud.width < 2 || cloud.height < 2) return false;
  const double as_sensor = spread_of_rays(cloud, Eigen::Isometry3d::Identity());
  return as_sensor < kStraight && as_sensor < spread_of_rays(cloud, X_FC);
}

/// Reads a PCD file (version 0.7 and earlier) line by line up to DATA; everything after that is point data,
/// whatever it looks like. Allocates nothing based on the header before the file is known to be long enough.
class PcdReader {
 public:
  explicit PcdReader(const std::filesystem::path& file) : file_(file) {
    std::error_code error;
    const auto kind = std::filesystem::status(file, error).type();
    // Checked before opening: opening a FIFO would block until there is a writer.
    if (kind != std::filesystem::file_type::regular) {
      fail(kind == std::filesystem::file_type::not_found ? "cannot be read"
                                                         : "cannot be read, it is not a regular file");
    }
    in_.open(file, std::ios::binary);
    size_ = std::filesystem::file_size(file, error);
    if (!in_ || error) fail("cannot be read");
    if (size_ == 0) fail("is empty, expected a PCD header");
  }

  RecordedCloud read() {
    while (header_.data.empty()) read_line();
    check_fields();
    check_counts();
    RecordedCloud recorded;
    camera::OrganizedCloud& cloud = recorded.cloud;
    cloud.width = static_cast<int>(header_.width);
    cloud.height = static_cast<int>(header_.height);
    present_ = size_ - static_cast<std::uintmax_t>(in_.tellg());
    if (header_.data == "ascii") {
      read_ascii(cloud.points);
    } else if (header_.data == "binary") {
      read_binary(cloud.points);
    } else {
      read_compressed(cloud.points);
    }
    if (header_.X_FC.isApprox(Eigen::Isometry3d::Identity()) || in_sensor_frame(cloud, header_.X_FC))
      return recorded;
    recorded.X_FC = header_.X_FC;
    const Eigen::Isometry3d X_CF = header_.X_FC.inverse();
    for (Eigen::Vector3f& p : cloud.points) p = (X_CF * p.cast<double>()).cast<float>();
    return recorded;
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
    } else if (key == "VIEWPOINT") {
      take_viewpoint(values);
    } else if (key == "DATA") {
      if (values.front() != "ascii" && values.front() != "binary" && values.front() != "binary_compressed")
        fail("DATA '" + values.front() + "', expected ascii, binary or binary_compressed");
      header_.data = values.front();
    }
  }

  void take_viewpoint(const std::vector<std::string>& values) {
    constexpr std::size_t kValues = 7;
    if (values.size() != kValues)
      fail("VIEWPOINT with " + std::to_string(values.size()) + " values, expected 7");
    std::array<double, kValues> v{};
    for (std::size_t i = 0; i < kValues; ++i) {
      const char* end = values[i].data() + values[i].size();
      const auto [read, error] = std::from_chars(values[i].data(), end, v[i]);
      if (error != std::errc{} || read != end || !std::isfinite(v[i]) || std::abs(v[i]) > kFarthest)
        fail("VIEWPOINT '" + values[i].substr(0, 40) + "', expected a number within ±1e6");
    }
    const Eigen::Quaterniond turn(v[3], v[4], v[5], v[6]);
    if (!(turn.norm() > kSmallestNorm)) fail("VIEWPOINT with a quaternion of zeros, expected a rotation");
    header_.X_FC.linear() = turn.normalized().toRotationMatrix();
    header_.X_FC.translation() = Eigen::Vector3d(v[0], v[1], v[2]);
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
    static constexpr std::array<const char*, 3> kAxes{"x", "y", "z"};
    std::vector<std::size_t> starts, columns;
    if (fields_.empty()) fail("no FIELDS line before DATA");
    if (counts_.empty()) counts_.assign(fields_.size(), 1);
    if (sizes_.size() != fields_.size() || types_.size() != fields_.size() ||
        counts_.size() != fields_.size())
      fail("FIELDS, SIZE, TYPE and COUNT differ in length");
    for (std::size_t i = 0; i < fields_.size(); ++i) {
      if (counts_[i] == 0) fail("COUNT 0 of field '" + fields_[i] + "'");
      starts.push_back(header_.point_bytes);
      columns.push_back(header_.values);
      header_.point_bytes += sizes_[i] * counts_[i];
      header_.values += counts_[i];
    }
    for (std::size_t k = 0; k < kAxes.size(); ++k) {
      const char* axis = kAxes[k];
      const auto at = std::find(fields_.begin(), fields_.end(), axis);
      if (at == fields_.end()) fail(std::string("no field '") + axis + "', expected x, y and z");
      const auto i = static_cast<std::size_t>(at - fields_.begin());
      if (sizes_[i] != 4 || types_[i] != "F" || counts_[i] != 1)
        fail(std::string("field '") + axis + "' is not one 4-byte float");
      header_.byte_offset[k] = starts[i];
      header_.column[k] = columns[i];
    }
  }

  void check_counts() {
    // Version 0.6 and earlier may omit WIDTH and HEIGHT.
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

  void need(std::uintmax_t bytes) const {
    if (present_ < bytes)
      fail("truncated: " + std::to_string(present_) + " bytes of points, expected " +
           (header_.data == "ascii" ? "at least " : "") + std::to_string(bytes));
  }

  std::vector<char> take(std::size_t bytes) {
    std::vector<char> out(bytes);
    if (!in_.read(out.data(), static_cast<std::streamsize>(bytes))) fail("cannot be read to its end");
    return out;
  }

  /// Fills `points`; x, y and z start at the offsets `first` and repeat every `stride` bytes. A non-finite
  /// value makes all three coordinates NaN.
  void place(const std::vector<char>& bytes, const std::array<std::size_t, 3>& first, std::size_t stride,
             std::vector<Eigen::Vector3f>& points) const {
    points.resize(header_.points);
    for (std::size_t i = 0; i < header_.points; ++i) {
      for (std::size_t k = 0; k < 3; ++k) {
        std::memcpy(&points[i][static_cast<Eigen::Index>(k)], &bytes.at(first[k] + i * stride),
                    sizeof(float));
      }
      if (!points[i].allFinite()) points[i].setConstant(std::numeric_limits<float>::quiet_NaN());
    }
  }

  void read_binary(std::vector<Eigen::Vector3f>& points) {
    const std::uintmax_t length = std::uintmax_t{header_.points} * header_.point_bytes;
    need(length);
    place(take(length), header_.byte_offset, header_.point_bytes, points);
  }

  /// Reads one LZF block: the first field of all points, then the second, and so on.
  void read_compressed(std::vector<Eigen::Vector3f>& points) {
    std::array<std::uint32_t, 2> sizes{};  // compressed, uncompressed; little-endian like all supported hosts
    if (present_ < sizeof sizes) fail("ends before the sizes of the compressed points");
    std::memcpy(sizes.data(), take(sizeof sizes).data(), sizeof sizes);
    const std::uintmax_t length = std::uintmax_t{header_.points} * header_.point_bytes;
    if (sizes[1] != length)
      fail("the compressed block states " + std::to_string(sizes[1]) + " bytes of points, expected " +
           std::to_string(length));
    need(sizeof sizes + std::uintmax_t{sizes[0]});
    if (length > kMostCompression * sizes[0])
      fail(std::to_string(sizes[0]) + " compressed bytes, too few for " + std::to_string(length) +
           " bytes of points");
    const std::vector<char> packed = take(sizes[0]);
    std::vector<char> bytes(length);
    const unsigned found = pcl::lzfDecompress(packed.data(), sizes[0], bytes.data(), sizes[1]);
    if (found != sizes[1])
      fail("damaged: " + std::to_string(found) + " bytes of points decompressed, expected " +
           std::to_string(length));
    std::array<std::size_t, 3> first = header_.byte_offset;
    for (std::size_t& offset : first) offset *= header_.points;
    place(bytes, first, sizeof(float), points);
  }

  void read_ascii(std::vector<Eigen::Vector3f>& points) {
    need(std::uintmax_t{header_.points} * header_.values * 2 - 1);  // one digit and one separator each
    points.reserve(header_.points);
    std::string text;
    while (points.size() < header_.points && std::getline(in_, text)) {
      ++line_;
      std::vector<std::string_view> words;
      for (std::size_t at = 0; (at = text.find_first_not_of(kBlank, at)) != std::string::npos;) {
        const std::size_t end = std::min(text.find_first_of(kBlank, at), text.size());
        words.push_back(std::string_view(text).substr(at, end - at));
        at = end;
      }
      if (words.empty()) continue;
      if (words.size() != header_.values)
        fail(std::to_string(words.size()) + " values in a point, expected " + std::to_string(header_.values));
      Eigen::Vector3f p;
      for (std::size_t k = 0; k < 3; ++k) p[static_cast<Eigen::Index>(k)] = number(words[header_.column[k]]);
      if (!p.allFinite()) p.setConstant(std::numeric_limits<float>::quiet_NaN());
      points.push_back(p);
    }
    if (points.size() < header_.points)
      fail("truncated: " + std::to_string(points.size()) + " points, expected " +
           std::to_string(header_.points));
  }

  [[nodiscard]] float number(std::string_view word) const {
    if (word.front() == '+') word.remove_prefix(1);
    float value = 0;
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
    if (error == std::errc::result_out_of_range) return std::numeric_limits<float>::quiet_NaN();
    if (error != std::errc{} || end != word.data() + word.size())
      fail("'" + std::string(word.substr(0, 40)) + "', expected a number");
    return value;
  }

  static constexpr const char* kBlank = " \t\r";

  const std::filesystem::path& file_;
  std::ifstream in_;
  std::uintmax_t size_ = 0;
  std::size_t line_ = 0;
  std::vector<std::string> fields_, types_;
  std::vector<std::size_t> sizes_, counts_;
  std::uintmax_t present_ = 0;  // bytes after the header
  bool has_points_ = false;
  PcdHeader header_;
};

// PCL prints its warnings to the terminal; the exceptions and codes that report errors are enough.
class QuietPcl {
 public:
  QuietPcl() : before_(pcl::console::getVerbosityLevel()) {
    pcl::console::setVerbosityLevel(pcl::console::L_ALWAYS);
  }
  ~QuietPcl() { pcl::console::setVerbosityLevel(before_); }
  QuietPcl(const QuietPcl&) = delete;
  QuietPcl& operator=(const QuietPcl&) = delete;

 private:
  pcl::console::VERBOSITY_LEVEL before_;
};

}  // namespace

RecordedCloud read_pcd(const std::filesystem::path& file) { return PcdReader(file).read(); }

void write_pcd(const std::filesystem::path& file, const camera::OrganizedCloud& cloud) {
  pcl::PointCloud<pcl::PointXYZ> points;
  points.reserve(cloud.points.size());
  for (const auto& p : cloud.points) points.emplace_back(p.x(), p.y(), p.z());
  if (points.empty() ||
      points.size() != static_cast<std::size_t>(cloud.width) * static_cast<std::size_t>(cloud.height))
    throw std::runtime_error(file.string() + ": not written: the cloud has " + std::to_string(points.size()) +
                             " points, expected " + std::to_string(cloud.width) + " times " +
                             std::to_string(cloud.height));
  points.width = static_cast<std::uint32_t>(cloud.width);
  points.height = static_cast<std::uint32_t>(cloud.height);
  points.is_dense = false;
  const QuietPcl quiet;
  try {
    if (pcl::PCDWriter().writeBinary(file.string(), points) == 0) return;
  } catch (const std::exception& error) {
    throw std::runtime_error(file.string() + ": not written: " + error.what());
  }
  throw std::runtime_error(file.string() + ": not written");
}

}  // namespace walkman::perception
