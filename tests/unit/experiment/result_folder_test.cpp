#include "apps/experiment/result_folder.h"

#include <fstream>
#include <set>
#include <sstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include "apps/shared/exit_code.h"
#include "apps/shared/result_files.h"

namespace walkman::apps {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

class ResultFolderTest : public ::testing::Test {
 protected:
  ResultFolderTest() { fs::remove_all(folder_); }
  ~ResultFolderTest() override { fs::remove_all(folder_); }

  void put(const std::string& name) const {
    fs::create_directories((folder_ / name).parent_path());
    std::ofstream(folder_ / name) << "x";
  }
  [[nodiscard]] static std::string contents(const fs::path& file) {
    std::ostringstream out;
    out << std::ifstream(file).rdbuf();
    return out.str();
  }
  [[nodiscard]] std::set<std::string> files() const {
    std::set<std::string> out;
    for (const auto& entry : fs::recursive_directory_iterator(folder_)) {
      if (!entry.is_directory()) out.insert(entry.path().lexically_relative(folder_).string());
    }
    return out;
  }

  fs::path folder_ =
      fs::path(::testing::TempDir()) /
      (std::string("walkman_") + ::testing::UnitTest::GetInstance()->current_test_info()->name());
};

TEST_F(ResultFolderTest, ASecondRunIsToldWhoHasTheFolder) {
  {
    const ResultFolder first(folder_);
    try {
      const ResultFolder second(folder_);
      FAIL() << "two runs write to one folder";
    } catch (const EnvironmentError& e) {
      EXPECT_THAT(e.what(), HasSubstr("in use by process " + std::to_string(getpid())));
    }
  }
  EXPECT_EQ(contents(folder_ / ".lock"), "");  // what a run leaves behind is identical to the byte
  EXPECT_NO_THROW(ResultFolder{folder_});
}

TEST_F(ResultFolderTest, WhatAnEarlierRunLeftIsRemovedAndNothingElse) {
  for (const char* stale :
       {"result.json", "can.log", "can.log.partial", "cloud.pcd", "wrench.csv", "state.csv", "dbc/rarm.dbc",
        "repetition-02/can.log", "repetition-02/dbc/rarm.dbc", "repetition-10/wrench.csv.partial"}) {
    put(stale);
  }
  for (const char* kept : {"notes.txt", "repetition-03/notes.txt", "repetition-old/can.log"}) put(kept);
  const ResultFolder folder(folder_);
  folder.clear();
  EXPECT_EQ(files(), (std::set<std::string>{".lock", "notes.txt", "repetition-03/notes.txt",
                                            "repetition-old/can.log"}));
  EXPECT_FALSE(fs::exists(folder_ / "repetition-02"));
}

TEST_F(ResultFolderTest, AResultReplacesTheOneBeforeAsAWhole) {
  const ResultFolder folder(folder_);
  folder.write_result("one");
  const ino_t before = [&] {
    struct stat status {};
    stat((folder_ / "result.json").c_str(), &status);
    return status.st_ino;
  }();
  std::ifstream reader(folder_ / "result.json");
  folder.write_result("two");
  struct stat status {};
  stat((folder_ / "result.json").c_str(), &status);
  EXPECT_NE(status.st_ino, before) << "written over, not renamed";
  std::string text;
  reader >> text;
  EXPECT_EQ(text, "one");
  EXPECT_EQ(contents(folder_ / "result.json"), "two");
  EXPECT_FALSE(fs::exists(folder_ / "result.json.partial"));
}

TEST_F(ResultFolderTest, AFullDeviceIsAnErrorAndLeavesTheResultOfBefore) {
  const ResultFolder folder(folder_);
  folder.write_result("one");
  fs::create_symlink("/dev/full", folder_ / "result.json.partial");
  EXPECT_THROW(folder.write_result("two"), EnvironmentError);
  EXPECT_EQ(contents(folder_ / "result.json"), "one");
}

TEST_F(ResultFolderTest, AFileInItsPlaceIsRefused) {
  std::ofstream(folder_) << "x";
  EXPECT_THROW(ResultFolder{folder_}, EnvironmentError);
}

}  // namespace
}  // namespace walkman::apps
