// Block transfer in bytes. CRCs were computed with another implementation (CRC-16/XMODEM).

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "emulator/nodes/cia301/block_crc.h"
#include "tests/unit/nodes/conversation.h"
#include "tests/unit/nodes/test_slave.h"

namespace walkman::nodes {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

struct SdoBlockTest : testing::Test {
  SdoBlockTest() { talk.listen(milliseconds(2)); }
  /// Returns segments 1.. of `text`; only the one that ends the text is flagged as the last.
  static Frames segments(const std::string& text, std::size_t from, std::size_t count) {
    Frames frames;
    for (std::size_t i = 0; i < count; ++i) {
      const std::size_t offset = 7 * (from + i);
      const bool last = offset + 7 >= text.size();
      char buffer[32];
      std::snprintf(buffer, sizeof buffer, "605#%02X", static_cast<unsigned>((last ? 0x80U : 0U) | (i + 1)));
      std::string frame = buffer;
      for (std::size_t k = offset; k < offset + 7; ++k) {
        std::snprintf(buffer, sizeof buffer, "%02X", k < text.size() ? static_cast<unsigned>(text[k]) : 0U);
        frame += buffer;
      }
      frames.push_back(frame);
    }
    return frames;
  }
  void send_all(const Frames& frames) {
    for (const std::string& frame : frames) talk.send(frame);
  }
  /// Computes the CRC bit by bit, as drawn in the standard.
  static unsigned crc_of(const std::string& text) {
    unsigned crc = 0;
    for (const char c : text) {
      for (int bit = 7; bit >= 0; --bit) {
        const unsigned in = (static_cast<unsigned>(c) >> static_cast<unsigned>(bit) & 1U) ^ (crc >> 15U & 1U);
        crc = (crc << 1U & 0xFFFFU) ^ (in != 0 ? 0x1021U : 0U);
      }
    }
    return crc;
  }
  static std::string end_frame(unsigned unused, unsigned crc) {
    char buffer[32];
    std::snprintf(buffer, sizeof buffer, "605#%02X%02X%02X0000000000", 0xC1U | unused << 2U, crc & 0xFFU,
                  crc >> 8U);
    return buffer;
  }
  static std::string text_of_length(std::size_t n) {
    std::string text;
    for (std::size_t i = 0; i < n; ++i) text += static_cast<char>('a' + i * 7 % 26);
    return text;
  }
  std::string note() { return node.dictionary().find(0x2060, 0)->text; }

  TestSlave node;
  Conversation talk{node};
};

TEST_F(SdoBlockTest, CrcIsXmodems) {
  const std::string check = "123456789";
  EXPECT_EQ(block_crc({reinterpret_cast<const std::uint8_t*>(check.data()), check.size()}), 0x31C3);
  EXPECT_EQ(block_crc({}), 0);
}

TEST_F(SdoBlockTest, UploadOfTwoSegments) {
  // 1008h "RShLat drive", 12 bytes, CRC 7078h; block size 127, no switch threshold.
  EXPECT_THAT(talk.ask("605#A40810007F000000"), ElementsAre("585#C60810000C000000"));
  EXPECT_THAT(talk.ask("605#A300000000000000"), ElementsAre("585#015253684C617420", "585#8264726976650000"));
  EXPECT_THAT(talk.ask("605#A2027F0000000000"), ElementsAre("585#C978700000000000"));
  EXPECT_THAT(talk.ask("605#A100000000000000"), IsEmpty());
  EXPECT_THAT(talk.ask("605#4000100000000000"), ElementsAre("585#4300100094010200"));
}

TEST_F(SdoBlockTest, UploadWithoutCrcHasNone) {
  EXPECT_THAT(talk.ask("605#A00810007F000000"), ElementsAre("585#C60810000C000000"));
  talk.ask("605#A300000000000000");
  EXPECT_THAT(talk.ask("605#A2027F0000000000"), ElementsAre("585#C900000000000000"));
}

TEST_F(SdoBlockTest, UploadInBlocksOfTheClientsSize) {
  EXPECT_THAT(talk.ask("605#A408100001000000"), ElementsAre("585#C60810000C000000"));
  EXPECT_THAT(talk.ask("605#A300000000000000"), ElementsAre("585#015253684C617420"));
  EXPECT_THAT(talk.ask("605#A201050000000000"), ElementsAre("585#8164726976650000"));
  EXPECT_THAT(talk.ask("605#A201050000000000"), ElementsAre("585#C978700000000000"));
}

TEST_F(SdoBlockTest, UploadSendsAgainWhatWasLost) {
  talk.ask("605#A40810007F000000");
  talk.ask("605#A300000000000000");
  // First nothing has arrived, then only the first segment.
  EXPECT_THAT(talk.ask("605#A2007F0000000000"), ElementsAre("585#015253684C617420", "585#8264726976650000"));
  EXPECT_THAT(talk.ask("605#A2017F0000000000"), ElementsAre("585#8164726976650000"));
  EXPECT_THAT(talk.ask("605#A2017F0000000000"), ElementsAre("585#C978700000000000"));
}

TEST_F(SdoBlockTest, SmallValuesComeTheOrdinaryWay) {
  // 12 bytes with a threshold of 12: segmented. 4 bytes: expedited. Without a threshold: a block.
  EXPECT_THAT(talk.ask("605#A40810007F0C0000"), ElementsAre("585#410810000C000000"));
  EXPECT_THAT(talk.ask("605#A40010007F040000"), ElementsAre("585#4300100094010200"));
  EXPECT_THAT(talk.ask("605#A40810007F0B0000"), ElementsAre("585#C60810000C000000"));
  EXPECT_THAT(talk.ask("605#A40010007F000000"), ElementsAre("585#C600100004000000"));
  EXPECT_THAT(talk.ask("605#A300000000000000"), ElementsAre("585#8194010200000000"));
}

TEST_F(SdoBlockTest, EmptyUpload) {
  EXPECT_THAT(talk.ask("605#A46020007F000000"), ElementsAre("585#C660200000000000"));
  EXPECT_THAT(talk.ask("605#A300000000000000"), ElementsAre("585#8100000000000000"));
  EXPECT_THAT(talk.ask("605#A2017F0000000000"), ElementsAre("585#DD00000000000000"));
}

TEST_F(SdoBlockTest, UploadOfTheLongestDomain) {
  TestSlave other(6);
  const std::string eds = text_of_length(131072);
  other.store_eds(eds);
  EXPECT_THROW(other.store_eds(eds + "x"), std::runtime_error);
  Conversation talk6{other};
  talk6.listen(milliseconds(2));
  EXPECT_THAT(talk6.ask("606#A42110007F000000"), ElementsAre("586#C621100000000200"));
  std::string received;
  talk6.send("606#A300000000000000");
  unsigned crc = 0;
  for (int block = 0; block < 200 && crc == 0; ++block) {
    const Frames frames = talk6.listen(milliseconds(30));
    for (const std::string& frame : frames) {
      for (std::size_t k = 6; k + 1 < frame.size(); k += 2) {
        received += static_cast<char>(std::stoul(frame.substr(k, 2), nullptr, 16));
      }
    }
    const auto last = std::stoul(frames.back().substr(4, 2), nullptr, 16);
    ASSERT_EQ(last & 0x7FU, frames.size());
    char answer[32];
    std::snprintf(answer, sizeof answer, "606#A2%02X7F0000000000", static_cast<unsigned>(frames.size()));
    const Frames next = last >= 0x80 ? talk6.ask(answer) : Frames{};
    if (last < 0x80) {
      talk6.send(answer);
    } else {
      crc = static_cast<unsigned>(std::stoul(next.at(0).substr(8, 2) + next.at(0).substr(6, 2), nullptr, 16));
      // 18725 segments of 7 bytes: 3 unused.
      EXPECT_EQ(next.at(0).substr(4, 2), "CD");
    }
  }
  received.resize(eds.size());
  EXPECT_EQ(received, eds);
  EXPECT_EQ(crc, crc_of(eds));
}

TEST_F(SdoBlockTest, AnEmptyDomainHasNoData) {
  EXPECT_THAT(talk.ask("605#4021100000000000"), ElementsAre("585#8021100024000008"));
  EXPECT_THAT(talk.ask("605#A42110007F000000"), ElementsAre("585#8021100024000008"));
}

TEST_F(SdoBlockTest, UploadAborts) {
  EXPECT_THAT(talk.ask("605#A408100000000000"), ElementsAre("585#8008100002000405"));  // block size 0
  EXPECT_THAT(talk.ask("605#A408100080000000"), ElementsAre("585#8008100002000405"));  // 128
  EXPECT_THAT(talk.ask("605#A43412007F000000"), ElementsAre("585#8034120000000206"));
  EXPECT_THAT(talk.ask("605#A300000000000000"), ElementsAre("585#8000000001000405"));  // nothing started
  talk.ask("605#A40810007F000000");
  talk.ask("605#A300000000000000");
  EXPECT_THAT(talk.ask("605#A2037F0000000000"), ElementsAre("585#8008100003000405"));  // two were sent
  talk.ask("605#A40810007F000000");
  talk.ask("605#A300000000000000");
  EXPECT_THAT(talk.ask("605#A202000000000000"), ElementsAre("585#8008100002000405"));
  talk.ask("605#A40810007F000000");
  EXPECT_THAT(talk.listen(milliseconds(1010)), ElementsAre("585#8008100000000405"));
}

TEST_F(SdoBlockTest, AClientsAbortStopsTheSegments) {
  talk.ask("605#A40810007F000000");
  talk.send("605#A300000000000000");
  talk.send("605#8008100000000405");
  EXPECT_LE(talk.listen(milliseconds(5)).size(), 2U);
  EXPECT_THAT(talk.listen(milliseconds(1100)), IsEmpty());
}

TEST_F(SdoBlockTest, DownloadOfTwoSegments) {
  // "hand-made", CRC DDB6h.
  EXPECT_THAT(talk.ask("605#C660200009000000"), ElementsAre("585#A46020007F000000"));
  EXPECT_THAT(talk.ask("605#0168616E642D6D61"), IsEmpty());
  EXPECT_THAT(talk.ask("605#8264650000000000"), ElementsAre("585#A2027F0000000000"));
  EXPECT_THAT(talk.ask("605#D5B6DD0000000000"), ElementsAre("585#A100000000000000"));
  EXPECT_EQ(note(), "hand-made");
}

TEST_F(SdoBlockTest, DownloadWithoutSizeAndCrc) {
  EXPECT_THAT(talk.ask("605#C060200000000000"), ElementsAre("585#A46020007F000000"));
  EXPECT_THAT(talk.ask("605#8168690000000000"), ElementsAre("585#A2017F0000000000"));
  EXPECT_THAT(talk.ask("605#D500000000000000"), ElementsAre("585#A100000000000000"));
  EXPECT_EQ(note(), "hi");
  // A number by block transfer.
  EXPECT_THAT(talk.ask("605#C202200002000000"), ElementsAre("585#A40220007F000000"));
  EXPECT_THAT(talk.ask("605#8112000000000000"), ElementsAre("585#A2017F0000000000"));
  EXPECT_THAT(talk.ask("605#D500000000000000"), ElementsAre("585#A100000000000000"));
  EXPECT_EQ(node.parameter.get(), 0x12);
}

TEST_F(SdoBlockTest, DownloadOfMoreThanOneBlock) {
  const std::string text = text_of_length(1024);  // 147 segments, the last with 2 bytes
  EXPECT_THAT(talk.ask("605#C660200000040000"), ElementsAre("585#A46020007F000000"));
  send_all(segments(text, 0, 127));
  EXPECT_THAT(talk.listen(milliseconds(30)), ElementsAre("585#A27F7F0000000000"));
  send_all(segments(text, 127, 20));
  EXPECT_THAT(talk.listen(milliseconds(30)), ElementsAre("585#A2147F0000000000"));
  EXPECT_THAT(talk.ask(end_frame(5, crc_of(text))), ElementsAre("585#A100000000000000"));
  EXPECT_EQ(note(), text);
}

TEST_F(SdoBlockTest, DownloadAsksForWhatWasLost) {
  const std::string text = text_of_length(70);
  talk.ask("605#C660200046000000");
  Frames frames = segments(text, 0, 10);
  frames.erase(frames.begin() + 4);  // segment 5
  send_all(frames);
  EXPECT_THAT(talk.listen(milliseconds(5)), ElementsAre("585#A2047F0000000000"));
  send_all(segments(text, 4, 6));  // numbered from 1 again
  EXPECT_THAT(talk.listen(milliseconds(5)), ElementsAre("585#A2067F0000000000"));
  EXPECT_THAT(talk.ask(end_frame(0, crc_of(text))), ElementsAre("585#A100000000000000"));
  EXPECT_EQ(note(), text);
}

TEST_F(SdoBlockTest, DownloadAborts) {
  EXPECT_THAT(talk.ask("605#C660200001040000"), ElementsAre("585#8060200012000706"));  // 1025 bytes
  EXPECT_THAT(talk.ask("605#C200100004000000"), ElementsAre("585#8000100002000106"));  // read-only
  EXPECT_THAT(talk.ask("605#C202200001000000"), ElementsAre("585#8002200013000706"));  // u16 of one byte
  EXPECT_THAT(talk.ask("605#C100000000000000"), ElementsAre("585#8000000001000405"));  // nothing started
  // Wrong CRC.
  talk.ask("605#C660200002000000");
  talk.ask("605#8168690000000000");
  EXPECT_THAT(talk.ask("605#D501020000000000"), ElementsAre("585#8060200004000405"));
  // Fewer bytes than announced.
  talk.ask("605#C660200003000000");
  talk.ask("605#8168690000000000");
  EXPECT_THAT(talk.ask("605#D500000000000000"), ElementsAre("585#8060200010000706"));
  // Sequence number 0.
  talk.ask("605#C660200003000000");
  EXPECT_THAT(talk.ask("605#0068690000000000"), ElementsAre("585#8060200003000405"));
  // More than the object holds, size not given.
  talk.ask("605#C402200000000000");
  talk.ask("605#0100000000000000");
  EXPECT_THAT(talk.ask("605#0200000000000000"), ElementsAre("585#8002200012000706"));
  // Values the object refuses.
  talk.ask("605#C202200002000000");
  talk.ask("605#8115000000000000");
  EXPECT_THAT(talk.ask("605#D500000000000000"), ElementsAre("585#8002200031000906"));
  // Silence.
  talk.ask("605#C660200009000000");
  EXPECT_THAT(talk.listen(milliseconds(1010)), ElementsAre("585#8060200000000405"));
  EXPECT_EQ(note(), "");
}

TEST_F(SdoBlockTest, AClientsAbortEndsADownload) {
  talk.ask("605#C660200009000000");
  EXPECT_THAT(talk.ask("605#8060200000000405"), IsEmpty());
  EXPECT_THAT(talk.ask("605#4000100000000000"), ElementsAre("585#4300100094010200"));
}

}  // namespace
}  // namespace walkman::nodes
