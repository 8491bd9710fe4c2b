#include "apps/campaign/supervised_child.h"

#include <atomic>
#include <csignal>
#include <functional>
#include <stdexcept>
#include <thread>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

namespace walkman::apps {
namespace {

using How = ChildEnd::How;

ChildEnd end_of(const std::function<void()>& job, const ChildLimits& limits = {60, 60}) {
  ChildEnd end;
  if (fork_and_wait(limits, end)) {
    job();
    _exit(0);
  }
  return end;
}

void die_by(int number) {
  std::signal(number, SIG_DFL);  // a sanitizer installs its own handlers
  kill(getpid(), number);
}

TEST(SupervisedChild, GoesOnWithWhatItsParentHasAndKeepsItsOwn) {
  int value = 5;
  const ChildEnd end = end_of([&] {
    if (value != 5) _exit(1);
    value = 6;
  });
  EXPECT_EQ(end.how, How::kClean);
  EXPECT_EQ(value, 5);
}

TEST(SupervisedChild, ACrashIsToldByItsSignalOrExitCode) {
  const ChildEnd signal = end_of([] { die_by(SIGSEGV); });
  EXPECT_EQ(signal.how, How::kCrashed);
  EXPECT_THAT(signal.text, ::testing::HasSubstr("signal 11"));
  const ChildEnd aborted = end_of([] { die_by(SIGABRT); });
  EXPECT_EQ(aborted.how, How::kCrashed);
  const ChildEnd code = end_of([] { _exit(5); });
  EXPECT_EQ(code.how, How::kCrashed);
  EXPECT_EQ(code.text, "exit code 5");
}

TEST(SupervisedChild, AMachineThatLacksSomethingIsNoCrash) {
  EXPECT_EQ(end_of([] { _exit(3); }).how, How::kLacking);
}

TEST(SupervisedChild, ASignalThatEndsTheCampaignIsNoCrash) {
  for (const int number : {SIGTERM, SIGINT, SIGHUP})
    EXPECT_EQ(end_of([&] { die_by(number); }).how, How::kEndedFrom) << number;
  EXPECT_EQ(end_of([] { die_by(SIGKILL); }).how, How::kKilled);
}

TEST(SupervisedChild, OneThatDoesNotEndIsEndedAtItsLimits) {
  const ChildEnd waits = end_of([] { pause(); }, {60, 0.1});
  EXPECT_EQ(waits.how, How::kHung);
  EXPECT_THAT(waits.text, ::testing::HasSubstr("0.1 s"));
  const ChildEnd works = end_of(
      [] {
        while (getppid() > 0) {  // the system call keeps the loop from being optimised away
        }
      },
      {1, 60});
  EXPECT_EQ(works.how, How::kHung);
  EXPECT_THAT(works.text, ::testing::HasSubstr("CPU time"));
}

TEST(SupervisedChild, NoneIsForkedOffAProcessOfSeveralThreads) {
  std::atomic<bool> over = false;
  std::thread other([&] { over.wait(false); });
  ChildEnd end;
  EXPECT_THROW(static_cast<void>(fork_and_wait({60, 60}, end)), std::logic_error);
  over = true;
  over.notify_all();
  other.join();
}

}  // namespace
}  // namespace walkman::apps
