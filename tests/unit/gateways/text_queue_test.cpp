#include "emulator/gateways/text_queue.h"

#include <random>
#include <string>

#include <gtest/gtest.h>

#include "emulator/gateways/text_line.h"

namespace walkman::gateways {
namespace {

TEST(TextQueue, TakesWholeMessagesOnly) {
  TextQueue queue(8);
  EXPECT_TRUE(queue.push("12345"));
  EXPECT_FALSE(queue.push("6789"));
  EXPECT_EQ(queue.text(), "12345");
  EXPECT_TRUE(queue.push("678"));
  EXPECT_EQ(queue.room(), 0U);
  EXPECT_TRUE(queue.push(""));
  EXPECT_EQ(queue.text(), "12345678");
}

TEST(TextQueue, KeepsTheOrderOverAnyPiecesGivenAway) {
  TextQueue queue(64);
  std::mt19937 random(1);
  std::string in;
  std::string out;
  for (int i = 0; i < 10'000; ++i) {
    const std::string message = std::to_string(i) + ";";
    if (queue.push(message)) in += message;
    const std::size_t taken = random() % (queue.text().size() + 1);
    out += queue.text().substr(0, taken);
    queue.pop(taken);
  }
  out += queue.text();
  EXPECT_GT(in.size(), 20'000U);
  EXPECT_EQ(in, out);
}

TEST(TextLine, WritesNumbersAndCutsWhatIsTooLong) {
  TextLine line;
  line.add_hex(0x5, 3);
  line.add(' ');
  line.add_decimal(42, 6);
  line.add(' ');
  line.add_decimal(18446744073709551615U);
  EXPECT_EQ(line.text(), "005 000042 18446744073709551615");
  line.add(std::string(300, 'x'));
  EXPECT_EQ(line.text().size(), 256U);
}

}  // namespace
}  // namespace walkman::gateways
