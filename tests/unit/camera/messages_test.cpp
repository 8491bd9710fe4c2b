// The wire format against what the vendor's client reads and writes: sizes and bytes of its protocol, worked
// out by hand.

#include "drivers/camera/multisense/messages.h"

#include <random>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "drivers/camera/multisense/datagram.h"
#include "drivers/camera/multisense/udp_port.h"

namespace walkman::multisense {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using Bytes = std::vector<std::uint8_t>;

std::vector<Bytes> cut(const Bytes& message, std::uint16_t sequence, std::size_t mtu) {
  std::vector<Bytes> out;
  Fragments fragments(message, sequence, mtu);
  while (!fragments.done()) fragments.next(out.emplace_back());
  return out;
}

Bytes long_message(std::size_t bytes) {
  Bytes message(bytes);
  for (std::size_t i = 0; i < bytes; ++i) message[i] = static_cast<std::uint8_t>(7 * i);
  return message;
}

TEST(MultiSenseMessages, HaveTheVendorsLengths) {
  EXPECT_EQ(encode(CameraConfig{}).size(), 139U);
  EXPECT_EQ(encode(CameraControl{}).size(), 92U);
  EXPECT_EQ(encode(CameraCalibration{}).size(), 460U);
  EXPECT_EQ(encode(ImageMetadata{}).size(), 4140U);
  EXPECT_EQ(encode(Query::kStatus), (Bytes{0x03, 0x00, 0x01, 0x00}));
}

TEST(MultiSenseMessages, HaveTheVendorsBytes) {
  EXPECT_THAT(encode(Ack{0x0017, Ack::kUnknown}),
              ElementsAre(0x01, 0, 0x01, 0, 0x17, 0, 0xFB, 0xFF, 0xFF, 0xFF));
  // The low words of both masks come before the high words.
  EXPECT_THAT(
      encode(StreamControl{0x0000000F'01000410, 0x00000002'00000400}),
      ElementsAre(0x1C, 0, 0x02, 0, 0x10, 0x04, 0x00, 0x01, 0x00, 0x04, 0, 0, 0x0F, 0, 0, 0, 0x02, 0, 0, 0));
  Version version;
  version.build_date = "ab";
  version.firmware = 0x0303;
  const Bytes bytes = encode(version);
  EXPECT_THAT(Bytes(bytes.begin(), bytes.begin() + 10),
              ElementsAre(0x02, 0x01, 0x01, 0, 2, 0, 'a', 'b', 3, 3));
  EXPECT_EQ(bytes.size(), 34U);
}

TEST(MultiSenseMessages, PackTwoPixelsInThreeBytes) {
  const Disparity image{5, 2, 1, {0xABC, 0x123}};
  const Bytes bytes = encode(image);
  EXPECT_THAT(bytes, ElementsAre(0x11, 0x01, 0x01, 0, 5, 0, 0, 0, 0, 0, 0, 0, 2, 0, 1, 0, 0xBC, 0x3A, 0x12));
  Disparity back;
  ASSERT_TRUE(decode(bytes, back));
  EXPECT_EQ(back.pixels, image.pixels);
  EXPECT_EQ(back.frame, 5);
  EXPECT_FALSE(decode(std::span(bytes).first(18), back));
}

TEST(MultiSenseMessages, HaveDisparitiesRoundedToSixteenthsOfAPixel) {
  std::vector<std::uint16_t> pixels(9);
  quantize(std::vector<float>{0, 0.03F, 0.04F, 10, 255.9F, 300}, pixels);
  EXPECT_THAT(pixels, ElementsAre(0, 0, 1, 160, 4094, 4095));
}

// Exposure and gain follow the pixels.
TEST(MultiSenseMessages, AnImageIsAsTheVendorsClientReadsIt) {
  Image image{std::uint64_t{1} << 4U, 8, 5, 2, 1, {0x33, 0x44}, 0x1234, 1};
  const Bytes bytes = encode(image);
  EXPECT_THAT(bytes, ElementsAre(0x10, 0x01, 3, 0, 0x10, 0, 0, 0, 8, 0, 0, 0, 5, 0, 0, 0, 0, 0, 0, 0, 2, 0, 1,
                                 0, 0x33, 0x44, 0x34, 0x12, 0, 0, 0, 0, 0x80, 0x3F, 0, 0, 0, 0));
  EXPECT_EQ(decode<Image>(bytes)->pixels, image.pixels);
  EXPECT_EQ(decode<Image>(bytes)->source, image.source);
  EXPECT_FALSE(decode<Image>(std::span(bytes).first(30)));
}

TEST(MultiSenseMessages, OfALaserHave8684BytesForAWholeTurn) {
  LidarData scan{7, {1, 2}, {1, 20752}, -5, 9, {}, {}};
  scan.ranges_mm.resize(1081, 1500);
  scan.intensities.resize(1081, 40);
  const Bytes bytes = encode(scan);
  EXPECT_EQ(bytes.size(), 8684U);
  EXPECT_EQ(decode<LidarData>(bytes)->first_microradians, -5);
  EXPECT_EQ(decode<LidarData>(bytes)->intensities[1080], 40U);
  EXPECT_EQ(encode(LidarCalibration{}).size(), 132U);
  EXPECT_EQ(encode(SetMotor{10}).size(), 8U);
}

TEST(MultiSenseMessages, AreReadByTheVersionTheyAreOf) {
  Bytes status = encode(Status{{12, 34}, 0x1F, 40, 50, {1, 2}, 3, 4, {5, 6, 7}});
  status[2] = 1;  // version 1 ends after the temperatures
  status.resize(24);
  const auto old = decode<Status>(status);
  ASSERT_TRUE(old);
  EXPECT_EQ(old->uptime.microseconds, 34U);
  EXPECT_EQ(old->imager_temperature_c[0], -99999);
  status[2] = 3;
  EXPECT_FALSE(decode<Status>(status));
  Bytes longer = encode(Mtu{1500});
  longer.push_back(9);  // of a later version
  EXPECT_EQ(decode<Mtu>(longer)->bytes, 1500U);
  EXPECT_FALSE(decode<Mtu>(encode(MtuTest{1500})));
}

TEST(MultiSenseMessages, OfAnyBytesAreReadWithinTheirBounds) {
  std::mt19937 random(1);
  DeviceInfo info;
  info.boards = {{"main", 2}, {"imager", 1}};
  DeviceModes modes;
  modes.modes.resize(6);
  const std::vector<Bytes> whole = {encode(info),
                                    encode(modes),
                                    encode(CameraConfig{}),
                                    encode(CameraControl{}),
                                    encode(ImageMetadata{}),
                                    encode(MtuAnswer{Bytes(99)}),
                                    encode(Image{16, 8, 1, 4, 3, Bytes(12)}),
                                    encode(LidarData{1, {}, {}, 0, 0, {1, 2, 3}, {4, 5, 6}}),
                                    encode(LidarCalibration{}),
                                    encode(Disparity{1, 4, 2, std::vector<std::uint16_t>(8)})};
  EXPECT_EQ(decode<DeviceInfo>(whole[0])->boards[1].name, "imager");
  for (int round = 0; round < 20000; ++round) {
    Bytes bytes = whole[random() % whole.size()];
    bytes.resize(random() % (bytes.size() + 1));
    for (int change = 0; change < 3 && bytes.size() > 4; ++change)
      bytes[2 + random() % (bytes.size() - 2)] = static_cast<std::uint8_t>(random());
    if (const auto read = decode<DeviceInfo>(bytes)) {
      EXPECT_LE(read->boards.size(), DeviceInfo::kMostBoards);
    }
    if (const auto read = decode<DeviceModes>(bytes)) {
      EXPECT_LE(read->modes.size(), DeviceModes::kMost);
    }
    static_cast<void>(decode<CameraConfig>(bytes));
    static_cast<void>(decode<CameraControl>(bytes));
    static_cast<void>(decode<ImageMetadata>(bytes));
    if (const auto read = decode<Image>(bytes)) {
      EXPECT_LE(read->pixels.size(), bytes.size());
    }
    if (const auto read = decode<LidarData>(bytes)) {
      EXPECT_LE(read->ranges_mm.size(), LidarData::kMostPoints);
    }
    static_cast<void>(decode<LidarCalibration>(bytes));
    if (const auto read = decode<MtuAnswer>(bytes)) {
      EXPECT_LE(read->filler.size(), bytes.size());
    }
    Disparity image;
    if (decode(bytes, image)) {
      EXPECT_LE(image.pixels.size(), bytes.size());
    }
  }
}

TEST(MultiSenseDatagrams, BeginWithTheVendorsHead) {
  const std::vector<Bytes> pieces = cut(encode(Mtu{1500}), 0x1234, 1500);
  ASSERT_EQ(pieces.size(), 1U);
  EXPECT_THAT(pieces[0], ElementsAre(0xAD, 0xAD, 0x00, 0x01, 0x01, 0x00, 0, 0, 0x34, 0x12, 8, 0, 0, 0, 0, 0,
                                     0, 0, 0x14, 0, 1, 0, 0xDC, 0x05, 0, 0));
}

TEST(MultiSenseDatagrams, FillTheMtu) {
  for (const auto& [mtu, bytes] : {std::pair<std::size_t, std::size_t>{1500, 1454}, {9000, 8954}}) {
    const std::vector<Bytes> pieces = cut(long_message(20000), 1, mtu);
    EXPECT_EQ(pieces[0].size(), kDatagramHeadBytes + bytes);
    EXPECT_EQ(pieces.size(), (20000 + bytes - 1) / bytes);
  }
}

TEST(MultiSenseDatagrams, OfADisparityImageHaveItsHeadAloneAndThenWholePairs) {
  Disparity image{1, 100, 60, std::vector<std::uint16_t>(6000, 77)};
  const std::vector<Bytes> pieces = cut(encode(image), 1, 1500);
  EXPECT_EQ(pieces[0].size(), kDatagramHeadBytes + 16);
  for (std::size_t i = 1; i < pieces.size(); ++i) EXPECT_EQ((pieces[i].size() - kDatagramHeadBytes) % 3, 0U);
}

TEST(MultiSenseDatagrams, MakeTheirMessageAgain) {
  const Bytes a = long_message(10000), b = long_message(5000);
  Assembler assembler;
  // Two messages with alternating datagrams.
  const std::vector<Bytes> first = cut(a, 0xFFFF, 1500), second = cut(b, 0, 1500);
  std::vector<Bytes> got;
  for (std::size_t i = 0; i < first.size(); ++i) {
    for (const auto* pieces : {&first, &second}) {
      if (i >= pieces->size()) continue;
      const auto message = assembler.take((*pieces)[i]);
      if (!message.empty()) got.emplace_back(message.begin(), message.end());
    }
  }
  EXPECT_THAT(got, ElementsAre(b, a));
  EXPECT_EQ(assembler.lost(), 0U);
}

TEST(MultiSenseDatagrams, ThatAreMissingLoseTheirMessageAlone) {
  const Bytes message = long_message(10000);
  const std::size_t pieces = cut(message, 0, 1500).size();
  Assembler assembler;
  for (std::size_t missing = 0; missing < pieces; ++missing) {
    std::vector<Bytes> holed = cut(message, static_cast<std::uint16_t>(2 * missing), 1500);
    holed.erase(holed.begin() + static_cast<std::ptrdiff_t>(missing));
    for (const Bytes& piece : holed) EXPECT_TRUE(assembler.take(piece).empty());
    std::size_t whole = 0;
    for (const Bytes& piece : cut(message, static_cast<std::uint16_t>(2 * missing + 1), 1500))
      whole += assembler.take(piece).size();
    EXPECT_EQ(whole, message.size());
  }
  // The loss of the message whose last datagram is missing has not been noticed yet.
  EXPECT_EQ(assembler.lost(), pieces - 1);
}

TEST(MultiSenseDatagrams, ThatComeTwiceHaveNoEffectTheSecondTime) {
  const Bytes message = long_message(10000);
  const std::vector<Bytes> pieces = cut(message, 7, 1500);
  Assembler assembler;
  std::size_t whole = 0;
  for (std::size_t i = 0; i < pieces.size(); ++i) {
    whole += assembler.take(pieces[i]).size();
    EXPECT_TRUE(assembler.take(pieces[i]).empty());
    EXPECT_TRUE(assembler.take(pieces[i > 0 ? i - 1 : 0]).empty());
  }
  EXPECT_EQ(whole, message.size());
  EXPECT_EQ(assembler.lost(), 0U);
}

TEST(MultiSenseDatagrams, ThatMakeNoSenseAreRefused) {
  const Bytes good = cut(encode(Mtu{1500}), 1, 1500)[0];
  const auto changed = [&](std::size_t at, std::uint8_t value) {
    Bytes bytes = good;
    bytes[at] = value;
    return bytes;
  };
  EXPECT_TRUE(read_head(good));
  EXPECT_FALSE(read_head(std::span(good).first(17)));
  EXPECT_FALSE(read_head(changed(0, 0)));   // magic
  EXPECT_FALSE(read_head(changed(3, 2)));   // version
  EXPECT_FALSE(read_head(changed(4, 2)));   // group
  EXPECT_FALSE(read_head(changed(10, 7)));  // more bytes than the message has
  EXPECT_FALSE(read_head(changed(14, 1)));  // beyond its end
  EXPECT_FALSE(read_head(changed(13, 1)));  // 16 MB
  Assembler assembler;
  std::mt19937 random(2);
  for (int i = 0; i < 20000; ++i) {
    Bytes bytes = cut(long_message(4000), static_cast<std::uint16_t>(random()), 1500)[random() % 3];
    for (int change = 0; change < 2; ++change) bytes[6 + random() % 12] = static_cast<std::uint8_t>(random());
    EXPECT_LE(assembler.take(bytes).size(), kMostMessageBytes);
  }
  EXPECT_GT(assembler.strange(), 0U);
}

TEST(UdpAddress, IsReadWithAndWithoutAPort) {
  EXPECT_EQ(parse_udp_address("127.0.0.1").host, 0x7F000001U);
  EXPECT_EQ(parse_udp_address("127.0.0.1").port, 9001);
  EXPECT_EQ(parse_udp_address("10.66.171.21:42").port, 42);
  for (const char* wrong :
       {"", "localhost", "127.0.0", "127.0.0.1:", "127.0.0.1:0", "127.0.0.1:70000", "127.0.0.1:9x"}) {
    try {
      static_cast<void>(parse_udp_address(wrong));
      ADD_FAILURE() << wrong;
    } catch (const std::runtime_error& e) {
      EXPECT_THAT(e.what(), HasSubstr("expected an IPv4 address"));
    }
  }
}

}  // namespace
}  // namespace walkman::multisense
