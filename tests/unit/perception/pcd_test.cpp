#include "adaptation/perception/pcd.h"

#include <cmath>
#include <filesystem>
#include <fstream>
#include <limits>
#include <random>
#include <sstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <pcl/io/pcd_io.h>
#include <pcl/point_types.h>
#include <sys/stat.h>

namespace walkman::perception {
namespace {

namespace fs = std::filesystem;
using testing::AllOf;
using testing::HasSubstr;

const fs::path kData = fs::path(WALKMAN_TEST_DATA) / "perception";

class PcdFile : public testing::Test {
 protected:
  void SetUp() override {
    file_ =
        fs::path(testing::TempDir()) /
        (std::string("walkman_") + testing::UnitTest::GetInstance()->current_test_info()->name() + ".pcd");
    fs::remove(file_);
  }
  void TearDown() override { fs::remove(file_); }

  void write(const std::string& bytes) const { std::ofstream(file_, std::ios::binary) << bytes; }

  [[nodiscard]] std::string error() const {
    testing::internal::CaptureStderr();
    std::string text = "none";
    try {
      static_cast<void>(read_pcd(file_));
    } catch (const std::runtime_error& e) {
      text = e.what();
    }
    EXPECT_EQ(testing::internal::GetCapturedStderr(), "") << "PCL must stay silent";
    EXPECT_THAT(text, HasSubstr(file_.filename().string()));
    EXPECT_EQ(std::count(text.begin(), text.end(), '\n'), 0);
    return text;
  }

  // Returns a header with one entry replaced.
  static std::string header(const std::string& points, const std::string& data, const std::string& width = "",
                            const std::string& fields = "x y z") {
    return "# .PCD v0.7\nVERSION 0.7\nFIELDS " + fields + "\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH " +
           (width.empty() ? points : width) + "\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS " + points +
           "\nDATA " + data + "\n";
  }

  fs::path file_;
};

camera::OrganizedCloud small_cloud() {
  camera::OrganizedCloud cloud;
  cloud.width = 5;
  cloud.height = 4;
  for (int i = 0; i < 20; ++i) cloud.points.emplace_back(0.1F * static_cast<float>(i), -0.25F, 1.0F);
  cloud.points[7].setConstant(std::numeric_limits<float>::quiet_NaN());
  return cloud;
}

void expect_same(const camera::OrganizedCloud& a, const camera::OrganizedCloud& b) {
  ASSERT_EQ(a.points.size(), b.points.size());
  for (std::size_t i = 0; i < a.points.size(); ++i) {
    EXPECT_EQ(a.points[i].hasNaN(), b.points[i].hasNaN());
    if (!a.points[i].hasNaN()) {
      EXPECT_EQ(a.points[i], b.points[i]);
    }
  }
}

TEST_F(PcdFile, WrittenCloudComesBack) {
  const auto cloud = small_cloud();
  write_pcd(file_, cloud);
  const auto back = read_pcd(file_).cloud;
  EXPECT_EQ(back.width, 5);
  EXPECT_EQ(back.height, 4);
  expect_same(cloud, back);
}

TEST_F(PcdFile, ReadsEveryEncodingOfPcl) {
  pcl::PointCloud<pcl::PointXYZRGBNormal> points;
  for (int i = 0; i < 60; ++i) {
    pcl::PointXYZRGBNormal p;
    p.x = static_cast<float>(i);
    p.y = 0.5F;
    p.z = 2.0F;
    points.push_back(p);
  }
  for (int encoding = 0; encoding < 3; ++encoding) {
    if (encoding == 0) pcl::io::savePCDFileASCII(file_.string(), points);
    if (encoding == 1) pcl::io::savePCDFileBinary(file_.string(), points);
    if (encoding == 2) pcl::io::savePCDFileBinaryCompressed(file_.string(), points);
    const auto cloud = read_pcd(file_).cloud;
    ASSERT_EQ(cloud.width, 60);
    EXPECT_EQ(cloud.height, 1);
    for (std::size_t i = 0; i < 60; ++i)
      EXPECT_EQ(cloud.points[i], Eigen::Vector3f(static_cast<float>(i), 0.5F, 2.0F));
  }
}

TEST_F(PcdFile, WritesWhatPclReads) {
  write_pcd(file_, small_cloud());
  pcl::PointCloud<pcl::PointXYZ> points;
  ASSERT_EQ(pcl::io::loadPCDFile(file_.string(), points), 0);
  EXPECT_EQ(points.width, 5U);
  EXPECT_EQ(points.height, 4U);
  EXPECT_FLOAT_EQ(points[13].x, 1.3F);
  EXPECT_TRUE(std::isnan(points[7].z));
}

TEST(PcdData, ReadsAHandWrittenFile) {
  const auto cloud = read_pcd(kData / "three_points.pcd").cloud;
  ASSERT_EQ(cloud.points.size(), 3U);
  EXPECT_EQ(cloud.points[1], Eigen::Vector3f(0.25F, -0.5F, 1.5F));
  EXPECT_TRUE(cloud.points[2].hasNaN());
}

TEST_F(PcdFile, MissingAndEmptyFiles) {
  EXPECT_THAT(error(), HasSubstr("cannot be read"));
  write("");
  EXPECT_THAT(error(), HasSubstr("is empty"));
}

TEST_F(PcdFile, TruncatedBinary) {
  write_pcd(file_, small_cloud());
  fs::resize_file(file_, fs::file_size(file_) - 13);
  EXPECT_THAT(error(), AllOf(HasSubstr("truncated"), HasSubstr("expected 240")));
}

TEST_F(PcdFile, EveryTruncationIsAnError) {
  write_pcd(file_, small_cloud());
  for (auto size = fs::file_size(file_) - 1; size > 0; size -= std::min<std::uintmax_t>(size, 7)) {
    fs::resize_file(file_, size);
    EXPECT_NE(error(), "none") << size;
  }
}

TEST_F(PcdFile, TruncatedAscii) {
  write(header("3", "ascii") + "0 0 1\n0 1 1\n");
  EXPECT_THAT(error(), HasSubstr("truncated"));
  write(header("2", "ascii") + "0 0 1\n0 1.00000\n");
  EXPECT_THAT(error(), AllOf(HasSubstr(".pcd:13"), HasSubstr("2 values in a point, expected 3")));
}

TEST_F(PcdFile, TruncatedCompressed) {
  pcl::PointCloud<pcl::PointXYZ> points;
  for (int i = 0; i < 500; ++i) points.emplace_back(static_cast<float>(i) * 0.37F, 0.0F, 1.0F);
  pcl::io::savePCDFileBinaryCompressed(file_.string(), points);
  fs::resize_file(file_, fs::file_size(file_) / 2);
  EXPECT_THAT(error(), HasSubstr("truncated"));
}

TEST_F(PcdFile, DamagedCompressedDataIsAnError) {
  std::string body(8 + 40, '\xff');
  body.replace(0, 8, std::string("\x28\0\0\0\x24\0\0\0", 8));  // 40 bytes that claim to be 36
  write(header("3", "binary_compressed") + body);
  EXPECT_NE(error(), "none");
}

TEST_F(PcdFile, AbsurdSizes) {
  write(header("99999999999999", "binary"));
  EXPECT_THAT(error(), HasSubstr("99999999999999"));
  write(header("-4", "binary"));
  EXPECT_THAT(error(), HasSubstr("'-4'"));
  write(header("60000000", "binary"));
  EXPECT_THAT(error(), HasSubstr("truncated"));
  write(header("7", "ascii", "9"));
  EXPECT_THAT(error(), HasSubstr("POINTS 7 is not WIDTH 9"));
  write(header("0", "ascii"));
  EXPECT_THAT(error(), HasSubstr("no points"));
}

TEST_F(PcdFile, MissingFieldsAndForeignFiles) {
  write(header("1", "ascii", "", "x y intensity") + "0 0 1\n");
  EXPECT_THAT(error(), HasSubstr("no field 'z'"));
  write("ply\nformat ascii 1.0\nelement vertex 3\n");
  EXPECT_THAT(error(), AllOf(HasSubstr(".pcd:1"), HasSubstr("not a PCD file")));
  write(std::string(10000, '\x7f'));
  EXPECT_THAT(error(), HasSubstr("not a PCD file"));
  write("VERSION 0.7\nFIELDS x y z\n");
  EXPECT_THAT(error(), HasSubstr("expected a DATA line"));
  write(header("1", "base64") + "0 0 1\n");
  EXPECT_THAT(error(), HasSubstr("DATA 'base64'"));
}

// A library's parser that keeps looking for header lines behind DATA would take these for its own.
TEST_F(PcdFile, LinesThatLookLikeAHeaderBehindDataAreNoHeader) {
  const std::string foreign = "POINTS 67108864\nWIDTH 67108864\nHEIGHT 1\nFIELDS a b c d\nDATA binary\n";
  write(header("2", "ascii") + foreign + "0 0 1\n0 1 1\n");
  EXPECT_THAT(error(), AllOf(HasSubstr(".pcd:12"), HasSubstr("2 values in a point, expected 3")));
  write(header("2", "ascii") + "0 0 1\n0 1 1\n" + foreign);
  EXPECT_EQ(read_pcd(file_).cloud.points.size(), 2U);
  for (const char* data : {"binary", "binary_compressed"}) {
    write(header("1500", data) + foreign + std::string(18000 - foreign.size(), '\x2a'));
    try {
      EXPECT_EQ(read_pcd(file_).cloud.points.size(), 1500U) << data;
    } catch (const std::runtime_error& e) {
      EXPECT_STREQ(data, "binary_compressed") << e.what();
    }
  }
}

TEST_F(PcdFile, FewBytesDoNotStandForManyPoints) {
  std::string body(64, '\0');
  body.replace(0, 8, std::string("\x38\0\0\0\0\0\0\x30", 8));  // 56 bytes that claim to be 768 MiB
  write(header("67108864", "binary_compressed") + body);
  EXPECT_THAT(error(), HasSubstr("too few"));
}

TEST_F(PcdFile, ValuesThatAreNoNumbersAndFilesThatAreNone) {
  write(header("2", "ascii") + "0 0 1\n0 one 1\n");
  EXPECT_THAT(error(), AllOf(HasSubstr(".pcd:13"), HasSubstr("'one', expected a number")));
  write(header("3", "ascii") + "+1.5 -2e-1 1\nnan 0 1\ninf 1e99 1\n");
  const auto cloud = read_pcd(file_).cloud;
  EXPECT_EQ(cloud.points[0], Eigen::Vector3f(1.5F, -0.2F, 1.0F));
  EXPECT_TRUE(cloud.points[1].array().isNaN().all());
  EXPECT_TRUE(cloud.points[2].array().isNaN().all());
  fs::remove(file_);
  ASSERT_EQ(mkfifo(file_.c_str(), 0600), 0);
  EXPECT_THAT(error(), HasSubstr("not a regular file"));  // and does not wait for a writer
}

// Whatever is changed in a file, the result is points as its header says, or an error of one sentence.
TEST_F(PcdFile, ChangedFilesAreReadOrRefused) {
  pcl::PointCloud<pcl::PointXYZRGBNormal> points;
  for (int i = 0; i < 40; ++i) {
    pcl::PointXYZRGBNormal p;
    p.x = static_cast<float>(i);
    points.push_back(p);
  }
  const std::vector<std::string> tokens = {
      "POINTS 67108864\n", "WIDTH 0\n", "HEIGHT 9\n", "DATA ascii\n", "SIZE 8 8 8\n", "COUNT 65536",
      "FIELDS x\n",        "nan ",      "-1 ",        "\n",           "x y z",        std::string(300, '9')};
  std::mt19937 random(1);
  int read = 0, refused = 0;
  for (int encoding = 0; encoding < 3; ++encoding) {
    if (encoding == 0) pcl::io::savePCDFileASCII(file_.string(), points);
    if (encoding == 1) pcl::io::savePCDFileBinary(file_.string(), points);
    if (encoding == 2) pcl::io::savePCDFileBinaryCompressed(file_.string(), points);
    std::ostringstream whole;
    whole << std::ifstream(file_, std::ios::binary).rdbuf();
    for (int i = 0; i < 1500; ++i) {
      std::string bytes = whole.str();
      for (unsigned changes = 1 + random() % 3; changes > 0; --changes) {
        if (bytes.empty()) break;
        // Half of the changes are in the header and just behind it.
        const std::size_t at =
            random() % (random() % 2 == 0 ? std::min<std::size_t>(400, bytes.size()) : bytes.size());
        switch (random() % 4) {
          case 0:
            bytes[at] = static_cast<char>(random() & 0xFFU);
            break;
          case 1:
            bytes.insert(at, tokens[random() % tokens.size()]);
            break;
          case 2:
            bytes.erase(at, 1 + random() % 8);
            break;
          default:
            bytes.resize(std::max<std::size_t>(at, 1));
            break;
        }
      }
      write(bytes);
      try {
        const auto cloud = read_pcd(file_).cloud;
        ASSERT_EQ(cloud.points.size(),
                  static_cast<std::size_t>(cloud.width) * static_cast<std::size_t>(cloud.height));
        ++read;
      } catch (const std::runtime_error& e) {
        ASSERT_THAT(e.what(), HasSubstr(file_.filename().string()));
        ++refused;
      }
    }
  }
  EXPECT_GT(read, 100);
  EXPECT_GT(refused, 100);
}

// Returns a tilted plane as a pinhole camera's image, in the camera's frame.
std::vector<Eigen::Vector3d> pinhole_image(int width, int height) {
  std::vector<Eigen::Vector3d> points;
  for (int row = 0; row < height; ++row)
    for (int column = 0; column < width; ++column) {
      const Eigen::Vector3d ray((column - width / 2.0) / width, (row - height / 2.0) / width, 1);
      points.push_back(ray / (ray.dot(Eigen::Vector3d(0.2, 0.7, 0.8))));
    }
  return points;
}

std::string viewpoint_of(const Eigen::Isometry3d& X) {
  const Eigen::Quaterniond q(X.linear());
  std::ostringstream text;
  text.precision(12);
  text << X.translation().x() << ' ' << X.translation().y() << ' ' << X.translation().z() << ' ' << q.w()
       << ' ' << q.x() << ' ' << q.y() << ' ' << q.z();
  return text.str();
}

std::string ascii_pcd(const std::vector<Eigen::Vector3d>& points, int width, const std::string& viewpoint) {
  std::ostringstream text;
  text.precision(9);
  text << "VERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH " << width << "\nHEIGHT "
       << points.size() / static_cast<std::size_t>(width) << "\nVIEWPOINT " << viewpoint << "\nDATA ascii\n";
  for (const auto& p : points) text << p.x() << ' ' << p.y() << ' ' << p.z() << '\n';
  return text.str();
}

TEST_F(PcdFile, ViewpointIsTheSensorsPoseInTheFilesFrame) {
  std::mt19937_64 random(5);
  std::normal_distribution<double> normal;
  const auto image = pinhole_image(48, 32);
  for (int i = 0; i < 20; ++i) {
    Eigen::Isometry3d X_FC = Eigen::Isometry3d::Identity();
    X_FC.linear() = Eigen::Quaterniond(normal(random), normal(random), normal(random), normal(random))
                        .normalized()
                        .toRotationMatrix();
    X_FC.translation() = Eigen::Vector3d(normal(random), normal(random), normal(random));
    std::vector<Eigen::Vector3d> in_file;
    in_file.reserve(image.size());
    for (const auto& p : image) in_file.push_back(X_FC * p);
    for (const int width : {48, 48 * 32}) {
      write(ascii_pcd(in_file, width, viewpoint_of(X_FC)));
      const RecordedCloud recorded = read_pcd(file_);
      EXPECT_TRUE(recorded.X_FC.isApprox(X_FC, 1e-9));
      for (std::size_t k = 0; k < image.size(); ++k)
        EXPECT_LT((recorded.cloud.points[k].cast<double>() - image[k]).norm(), 1e-5);
    }
    // A grabber's file: the sensor's own coordinates, regardless of its pose. Its pixels' rays are straight.
    write(ascii_pcd(image, 48, viewpoint_of(X_FC)));
    const RecordedCloud grabbed = read_pcd(file_);
    EXPECT_TRUE(grabbed.X_FC.isApprox(Eigen::Isometry3d::Identity()));
    EXPECT_LT((grabbed.cloud.points[100].cast<double>() - image[100]).norm(), 1e-6);
  }
}

TEST_F(PcdFile, ViewpointsThatAreNoPoses) {
  const auto image = pinhole_image(4, 2);
  for (const char* viewpoint : {"0 0 0 1 0 0", "0 0 0 1 0 0 0 0", "0 0 nan 1 0 0 0", "0 0 here 1 0 0 0",
                                "0 0 1e9 1 0 0 0", "0 0 0 0 0 0 0", "0 0 0 inf 0 0 0"}) {
    write(ascii_pcd(image, 4, viewpoint));
    EXPECT_THAT(error(), AllOf(HasSubstr(".pcd:8"), HasSubstr("VIEWPOINT"))) << viewpoint;
  }
  write(ascii_pcd(image, 4, "0 0 0 2 0 0 0"));
  EXPECT_TRUE(read_pcd(file_).X_FC.isApprox(Eigen::Isometry3d::Identity()));
}

TEST_F(PcdFile, UnwritablePlaceIsAnError) {
  EXPECT_THROW(write_pcd("/nonexistent/folder/cloud.pcd", small_cloud()), std::runtime_error);
  auto cloud = small_cloud();
  cloud.width = 6;
  EXPECT_THROW(write_pcd(file_, cloud), std::runtime_error);
}

}  // namespace
}  // namespace walkman::perception
