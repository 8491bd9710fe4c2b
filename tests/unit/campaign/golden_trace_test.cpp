#include "apps/campaign/golden_trace.h"

#include <array>
#include <filesystem>
#include <fstream>

#include <gtest/gtest.h>
#include <unistd.h>

namespace walkman::apps {
namespace {

TEST(GoldenTrace, IsReadAsItWasWrittenAndNothingElseIs) {
  const std::filesystem::path file =
      std::filesystem::temp_directory_path() / ("golden_trace_" + std::to_string(getpid()));
  GoldenTrace trace;
  trace.add(7, std::array{1.0F, -2.5F, 3.0F});
  trace.add(0xFFFFFFFFFFFFFFFF, std::array{4.0F, 5.0F, -6.0F});
  const std::string bytes = trace.bytes();
  std::ofstream(file, std::ios::binary) << bytes;
  const GoldenTrace read = GoldenTrace::load(file);
  ASSERT_EQ(read.cycles(), 2U);
  EXPECT_EQ(read.hash(0), 7U);
  EXPECT_EQ(read.hash(1), 0xFFFFFFFFFFFFFFFFU);
  ASSERT_EQ(read.positions(1).size(), 3U);
  EXPECT_EQ(read.positions(0)[1], -2.5F);
  EXPECT_EQ(read.positions(1)[2], -6.0F);
  for (const std::size_t length : {std::size_t{0}, std::size_t{5}, std::size_t{12}, bytes.size() - 4}) {
    std::ofstream(file, std::ios::binary) << bytes.substr(0, length);
    EXPECT_THROW(static_cast<void>(GoldenTrace::load(file)), std::runtime_error) << length;
  }
  std::ofstream(file, std::ios::binary) << std::string(64, '\xFF');
  EXPECT_THROW(static_cast<void>(GoldenTrace::load(file)), std::runtime_error);
  std::filesystem::remove(file);
  EXPECT_THROW(static_cast<void>(GoldenTrace::load(file)), std::runtime_error);
}

}  // namespace
}  // namespace walkman::apps
