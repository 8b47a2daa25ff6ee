#include "base/printable.h"
#include "tests/unit/client/instrument.h"

#include <gtest/gtest.h>

#include <regex>
#include <string>
#include <utility>

namespace traction::client::board_test {
namespace {

using test::has;
using test::Instrument;
using test::kSecond_ns;

TEST(Board, LedgerIsCountedByCausePerSecondAndInTotal) {
  Instrument one;
  v1::Ledger& ledger = *one.status.mutable_ledger();
  ledger.set_received(70'000);
  ledger.set_missing(40);
  one.sendStatus();
  one.now += 2 * kSecond_ns;  // a status was lost: the difference is of two seconds
  ledger.set_received(70'119);
  ledger.set_missing(41);
  one.sendStatus();
  one.field();
  for (const auto& [name, numbers] : {std::pair{"received", " *59\\.5 +70119"}, {"never arrived", " *0\\.5 +41"}})
    EXPECT_TRUE(std::regex_match(one.row(name), std::regex(numbers))) << name << ": " << one.row(name);
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
  one.sendStatus();
  for (const std::string& text : {one.board(), boardText(one.watched, one.now), boardLine(one.watched, one.now)})
    EXPECT_TRUE(has(text, "a?]0;evil?b?31mc é")) << text;
  // Bytes that are not UTF-8: no message of Protobuf has them.
  EXPECT_EQ(printable("b\x9b"
                      "31m\xe2\x82 é\xed\xa0\x80"),
            "b?31m?? é???");
}

}  // namespace
}  // namespace traction::client::board_test
