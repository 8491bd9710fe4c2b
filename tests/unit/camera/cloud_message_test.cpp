#include "drivers/camera/cloud_message.h"

#include <cmath>
#include <random>
#include <stdexcept>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace walkman::camera {
namespace {

using namespace std::chrono_literals;
using ::testing::HasSubstr;
using Bytes = std::vector<std::uint8_t>;

MessageHeader header_of(const Bytes& bytes) {
  return read_header(std::span<const std::uint8_t, kHeaderBytes>(bytes.data(), kHeaderBytes));
}

std::span<const std::uint8_t> payload_of(const Bytes& bytes) {
  return std::span(bytes).subspan(kHeaderBytes);
}

/// Head and points, as they go over the socket.
Bytes whole_cloud(Time now, const OrganizedCloud& cloud) {
  Bytes bytes = encode_cloud_head(now, cloud);
  for (const std::byte byte : std::as_bytes(std::span(cloud.points)))
    bytes.push_back(static_cast<std::uint8_t>(byte));
  return bytes;
}

/// What a header with these bytes is refused with; empty when it is not.
std::string refusal(Bytes bytes) {
  bytes.resize(kHeaderBytes);
  try {
    (void)header_of(bytes);
  } catch (const std::runtime_error& e) {
    return e.what();
  }
  return {};
}

// Written out by hand from the table in cloud_message.h.
TEST(CloudMessage, BytesOnTheWire) {
  EXPECT_EQ(encode_request(5ms), (Bytes{'W',  'M',  'C',  'L', 2, 0, 2, 0, 8, 0, 0, 0,  //
                                        0x40, 0x4B, 0x4C, 0,   0, 0, 0, 0}));
  EXPECT_EQ(encode_none(1ns), (Bytes{'W', 'M', 'C', 'L', 2, 0, 3, 0, 8, 0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0}));
  Hello hello;
  hello.now = 256ns;
  hello.width = 1024;
  hello.height = 512;
  EXPECT_EQ(encode(hello), (Bytes{'W', 'M', 'C', 'L', 2, 0, 1, 0, 16, 0, 0, 0,  //
                                  0,   1,   0,   0,   0, 0, 0, 0,               //
                                  0,   4,   0,   0,   0, 2, 0, 0}));
  OrganizedCloud cloud;
  cloud.stamp = 2ns;
  cloud.frame = 3;
  cloud.width = 1;
  cloud.height = 1;
  cloud.points = {{1.0F, -2.0F, 0.5F}};
  EXPECT_EQ(whole_cloud(7ns, cloud), (Bytes{'W', 'M', 'C',  'L',  2, 0, 4, 0,    44, 0, 0, 0,  //
                                            7,   0,   0,    0,    0, 0, 0, 0,                  //
                                            2,   0,   0,    0,    0, 0, 0, 0,                  //
                                            3,   0,   0,    0,    0, 0, 0, 0,                  //
                                            1,   0,   0,    0,    1, 0, 0, 0,                  //
                                            0,   0,   0x80, 0x3F, 0, 0, 0, 0xC0, 0,  0, 0, 0x3F}));
}

TEST(CloudMessage, ComesBackAsItWent) {
  OrganizedCloud cloud;
  cloud.stamp = 1234567ns;
  cloud.frame = 99;
  cloud.width = 3;
  cloud.height = 2;
  for (int i = 0; i < 6; ++i) cloud.points.emplace_back(0.1F * i, -i, i == 4 ? std::nanf("") : 2.5F);
  const Bytes bytes = whole_cloud(2s, cloud);
  EXPECT_EQ(header_of(bytes).type, MessageType::kCloud);
  EXPECT_EQ(header_of(bytes).length + kHeaderBytes, bytes.size());
  OrganizedCloud back;
  EXPECT_EQ(decode_cloud(payload_of(bytes), back), 2s);
  EXPECT_EQ(back.stamp, cloud.stamp);
  EXPECT_EQ(back.frame, 99U);
  EXPECT_EQ(back.width, 3);
  EXPECT_EQ(back.height, 2);
  EXPECT_EQ(back.at(1, 0), cloud.at(1, 0));
  EXPECT_TRUE(std::isnan(back.at(1, 1).z()));
}

TEST(CloudMessage, RefusesWhatIsNoHeader) {
  EXPECT_THAT(refusal({'H', 'T', 'T', 'P', '/', '1', '.', '1', ' ', '2', '0', '0'}), HasSubstr("WMCL"));
  EXPECT_THAT(refusal({'W', 'M', 'C', 'L', 1, 0, 2, 0, 8, 0, 0, 0}), HasSubstr("version 1, expected 2"));
  EXPECT_THAT(refusal({'W', 'M', 'C', 'L', 2, 0, 9, 0, 8, 0, 0, 0}), HasSubstr("type 9"));
  EXPECT_THAT(refusal({'W', 'M', 'C', 'L', 2, 0, 2, 0, 9, 0, 0, 0}), HasSubstr("9 bytes, expected 8"));
  EXPECT_THAT(refusal({'W', 'M', 'C', 'L', 2, 0, 4, 0, 0xFF, 0xFF, 0xFF, 0xFF}),
              HasSubstr("4294967295 bytes"));
  EXPECT_EQ(refusal({'W', 'M', 'C', 'L', 2, 0, 2, 0, 8, 0, 0, 0}), "");
}

TEST(CloudMessage, RefusesPayloadsThatDoNotHoldTogether) {
  OrganizedCloud cloud;
  cloud.width = cloud.height = 2;
  cloud.points.resize(4, Eigen::Vector3f::Zero());
  Bytes bytes = whole_cloud(1s, cloud);
  OrganizedCloud out;
  bytes[kHeaderBytes + 24] = 3;  // width 3: the points no longer fit
  EXPECT_THROW((void)decode_cloud(payload_of(bytes), out), std::runtime_error);
  bytes[kHeaderBytes + 24] = 0;
  EXPECT_THROW((void)decode_cloud(payload_of(bytes), out), std::runtime_error);
  bytes[kHeaderBytes + 27] = 0x80;  // width 2^31: 32 bits would wrap
  EXPECT_THROW((void)decode_cloud(payload_of(bytes), out), std::runtime_error);
  cloud.stamp = 2s;  // exposed in the future
  bytes = whole_cloud(1s, cloud);
  EXPECT_THROW((void)decode_cloud(payload_of(bytes), out), std::runtime_error);
  EXPECT_THROW((void)decode_cloud({}, out), std::runtime_error);
  EXPECT_THROW((void)decode_request(payload_of(encode_request(-1ns))), std::runtime_error);
  Hello hello;
  hello.width = 5000;
  hello.height = 1;
  EXPECT_THROW((void)decode_hello(payload_of(encode(hello))), std::runtime_error);
}

TEST(CloudMessage, NoiseIsRefusedOrReadWithinItsBounds) {
  std::mt19937 random(7);
  OrganizedCloud out;
  for (int i = 0; i < 20000; ++i) {
    Bytes bytes(random() % 96);
    for (auto& byte : bytes)
      byte = static_cast<std::uint8_t>(random() % 5);  // small numbers: plausible sizes
    try {
      (void)decode_cloud(bytes, out);
      EXPECT_EQ(bytes.size(), 32 + 12 * out.points.size());
    } catch (const std::runtime_error&) {
    }
  }
}

}  // namespace
}  // namespace walkman::camera
