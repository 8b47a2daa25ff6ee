#include "client/src/printable.h"
#include "tests/support/seed.h"
#include "tests/unit/client/instrument.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <regex>
#include <string>

namespace traction::client::board_test {
namespace {

using test::has;
using test::Instrument;
using test::kSecond_ns;

TEST(Board, LedgerIsCountedByCausePerSecondAndInTotal) {
  std::mt19937 random(tractiond::test::seed());
  using Set = void (v1::Ledger::*)(std::uint64_t);
  const std::pair<const char*, Set> kinds[] = {{"received", &v1::Ledger::set_received},
                                               {"evicted before track", &v1::Ledger::set_evicted_before_track},
                                               {"never arrived", &v1::Ledger::set_missing},
                                               {"reconnects", &v1::Ledger::set_reconnects}};
  for (int trial = 0; trial < 20; ++trial) {
    Instrument one;
    std::vector<unsigned> before, more;
    v1::Ledger& ledger = *one.status.mutable_ledger();
    for (const auto& [name, set] : kinds) (ledger.*set)(before.emplace_back(random() % 100'000));
    one.sendStatus();
    one.now += 2 * kSecond_ns;  // a status was lost: the difference is of two seconds
    for (std::size_t i = 0; i < std::size(kinds); ++i)
      (ledger.*kinds[i].second)(before[i] + more.emplace_back(random() % 200));
    one.sendStatus();
    one.field();
    const std::string page = one.board();
    for (std::size_t i = 0; i < std::size(kinds); ++i) {
      const std::string name = kinds[i].first;
      std::smatch match;
      const std::string row = one.row(name);
      ASSERT_TRUE(std::regex_match(row, match, std::regex(" *(\\d+\\.\\d) +(\\d+)"))) << name << ": " << row;
      EXPECT_NEAR(std::stod(match[1]), more[i] / 2.0, 0.051) << name;
      EXPECT_EQ(std::stoul(match[2]), before[i] + more[i]) << name;
      EXPECT_TRUE(std::regex_search(page, std::regex(name + " +" + match[1].str() + " +" + match[2].str())))
          << name << "\n"
          << page;
    }
  }
}

TEST(Board, WhatIsOldLooksOldWithinHalfASecond) {
  Instrument one;
  one.run(3.3);
  one.now -= kSecond_ns / 60;  // the last field is of now
  EXPECT_TRUE(has(one.board(), "no flags"));
  EXPECT_TRUE(has(one.board(), " +0.250 -0.500 +3.750 N"));
  EXPECT_FALSE(has(one.board(), "("));
  one.now += 480'000'000 - 60'000'000;  // less the time from page to page
  for (const std::string& text : {one.board(), boardText(one.watched, one.now), boardLine(one.watched, one.now)}) {
    EXPECT_TRUE(has(text, "(+0.250 -0.500 +3.750 N)")) << text;
    EXPECT_TRUE(has(text, "(camera ")) << text;
    EXPECT_TRUE(has(text, "! no field for 0.4 s")) << text;
  }
  EXPECT_TRUE(has(one.board(), "frames, not of now"));
}

TEST(Board, RealTimeIsWhatWasGrantedAndACryWhereItWasNot) {
  Instrument one;
  one.run(2.0);
  EXPECT_EQ(one.row("real time"), "off");
  v1::Scheduling& scheduling = *one.status.mutable_scheduling();
  const auto thread = [&](const char* name, unsigned priority, const char* cpus) {
    v1::ThreadScheduling& added = *scheduling.add_threads();
    added.set_name(name);
    added.set_priority(priority);
    added.set_cpus(cpus);
  };
  thread("tr-track", 20, "2-3");
  thread("ZMQbg/IO/0", 19, "2-3");
  const auto page = [&] {
    one.run(2.0);
    return one.board();
  };
  scheduling.set_asked_priority(20);
  scheduling.set_asked_cpus("2-3");
  scheduling.set_asked_lock(true);
  scheduling.set_locked_bytes(512 << 20);
  EXPECT_FALSE(has(page(), "not granted"));
  EXPECT_EQ(one.row("real time"), "priority 19 to 20 on 2-3, memory locked");
  scheduling.mutable_threads(0)->set_priority(0);
  scheduling.mutable_threads(0)->set_cpus("0-3");
  EXPECT_TRUE(has(page(), "! real time is not granted: priority 20, processors 2-3")) << one.board();
  scheduling.mutable_threads(1)->set_priority(0);
  scheduling.set_locked_bytes(0);
  EXPECT_TRUE(has(page(), "! real time is not granted: priority 20, processors 2-3, memory")) << one.board();
}

TEST(Board, WithoutAGelTheReasonIsSaidOnceAndNoFrameIsLost) {
  Instrument one;
  one.status.mutable_markers()->set_remark("no gel: nothing is measured; set sensor.gel_file");
  for (unsigned i = 1; i <= 2; ++i) {
    one.status.mutable_ledger()->set_received(60 * i);
    one.status.mutable_ledger()->set_no_gel(60 * i);
    one.now += kSecond_ns;
    one.sendStatus();
  }
  const std::string page = one.board(120, 24);
  const std::size_t first = page.find("no gel: nothing is measured");
  ASSERT_NE(first, std::string::npos) << page;
  EXPECT_EQ(page.find("no gel: nothing is measured", first + 1), std::string::npos) << page;
  EXPECT_TRUE(std::regex_search(page, std::regex("no gel +60\\.0 +120"))) << page;
  EXPECT_TRUE(has(boardLine(one.watched, one.now), "lost 0")) << boardLine(one.watched, one.now);
}

TEST(Board, FlagsAreWordsForAsLongAsOneCanRead) {
  Instrument one;
  one.run(2.0);
  one.flags = kTorn | kFewMarkers;
  one.field();
  one.flags = 0;
  one.run(1.0);
  EXPECT_TRUE(has(one.board(), "! too few markers; picture torn")) << one.board();
  one.run(2.0);
  EXPECT_TRUE(has(one.board(), "no flags")) << one.board();
}

TEST(Board, TerminalObeysNobodyElse) {
  Instrument one;
  one.status.set_camera_why("a\x1b]0;evil\x07"
                            "b\xc2\x9b"
                            "31mc é");
  one.status.set_camera(v1::CAMERA_STATE_WAITING);
  one.status.mutable_camera_link()->set_ptp("\x1b[2J");
  one.sendStatus();
  for (const std::string& text : {one.board(), boardText(one.watched, one.now), boardLine(one.watched, one.now)}) {
    EXPECT_TRUE(
        std::all_of(text.begin(), text.end(), [](char c) { return c == '\n' || (c >= 0x20 ? c != 0x7f : c < 0); }));
    EXPECT_FALSE(has(text, "\xc2\x9b"));
    EXPECT_TRUE(has(text, "a?]0;evil?b?31mc é")) << text;
  }
  // Bytes that are not UTF-8: no message of Protobuf has them.
  EXPECT_EQ(printable("b\x9b"
                      "31m\xe2\x82 é"),
            "b?31m?? é");
  for (const char* const no :
       {"\xe0\x9f\xbf", "\xed\xa0\x80", "\xf0\x8f\xbf\xbf", "\xf4\x90\x80\x80", "\xf5\x80\x80\x80"}) {
    EXPECT_EQ(printable(no), std::string(std::string_view(no).size(), '?'));
  }
  EXPECT_EQ(printable("\xe0\xa0\x80\xed\x9f\xbf\xf0\x90\x80\x80\xf4\x8f\xbf\xbf"),
            "\xe0\xa0\x80\xed\x9f\xbf\xf0\x90\x80\x80\xf4\x8f\xbf\xbf");
}

}  // namespace
}  // namespace traction::client::board_test
