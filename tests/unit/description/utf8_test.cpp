#include "urdf/reader/utf8.h"

#include <gtest/gtest.h>

namespace walkman {
namespace {

// The boundaries are those of RFC 3629, sections 3 and 4.
TEST(Utf8, WellFormedTextPasses) {
  for (const char* text : {"", "N·m", "\x7F", "\xC2\x80", "\xDF\xBF", "\xE0\xA0\x80", "\xED\x9F\xBF",
                           "\xEE\x80\x80", "\xEF\xBF\xBF", "\xF0\x90\x80\x80", "\xF4\x8F\xBF\xBF"})
    EXPECT_FALSE(first_non_utf8(text)) << text;
}

TEST(Utf8, TheFirstByteThatIsNotIsFound) {
  EXPECT_EQ(first_non_utf8("caf\xE9"), 3U);
  EXPECT_EQ(first_non_utf8("\x80"), 0U);              // a lone continuation byte
  EXPECT_EQ(first_non_utf8("a\xC0\xAF"), 1U);         // overlong slash
  EXPECT_EQ(first_non_utf8("\xE0\x9F\xBF"), 0U);      // overlong
  EXPECT_EQ(first_non_utf8("\xED\xA0\x80"), 0U);      // surrogate
  EXPECT_EQ(first_non_utf8("\xF4\x90\x80\x80"), 0U);  // above U+10FFFF
  EXPECT_EQ(first_non_utf8("\xF0\x90\x80"), 0U);      // truncated
  EXPECT_EQ(first_non_utf8("\xFF"), 0U);
}

TEST(Printable, WhatATerminalWouldActOnIsMadeVisible) {
  EXPECT_EQ(printable("a\x1B[2Jb\n\tc"), "a\\x1B[2Jb\n\tc");
  EXPECT_EQ(printable("bell\a, \r, \x7F"), "bell\\x07, \\x0D, \\x7F");
  EXPECT_EQ(printable("\xC2\x9B"
                      "31m"),
            "\\u009B31m");                                        // CSI as a single character
  EXPECT_EQ(printable("\xE2\x80\xAEtxt.exe"), "\\u202Etxt.exe");  // right-to-left override
  EXPECT_EQ(printable("caf\xE9"), "caf\\xE9");
  EXPECT_EQ(printable("1 N·m, 25 °C"), "1 N·m, 25 °C");
}

TEST(Printable, ASentenceStaysOnItsLine) { EXPECT_EQ(one_line("a\nb\tc"), "a\\x0Ab\\x09c"); }

}  // namespace
}  // namespace walkman
