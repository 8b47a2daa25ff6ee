#include "gateway/request.h"
#include "tests/support/seed.h"
#include "traction/v1/control.pb.h"

#include <gtest/gtest.h>

#include <random>

namespace tractiond::gateway::request_test {
namespace {

namespace pb = traction::v1;

/// Random bytes, or a request of random content, forged, cut or spoilt.
std::string anything(std::mt19937& random) {
  const auto letters = [&](std::size_t most) {
    std::string text(random() % (most + 1), '\0');
    for (char& c : text) c = static_cast<char>(random());
    return text;
  };
  if (random() % 4 == 0) return letters(100);
  pb::Request request;
  request.set_version(static_cast<std::uint32_t>(random() % 3));
  if (random() % 2 == 0)
    request.mutable_zero()->set_anyway(random() % 2 == 0);
  else
    request.mutable_camera()->mutable_read()->set_name("ExposureTime");
  request.set_on_behalf_of("the queen");
  std::string bytes = request.SerializeAsString();
  if (random() % 3 == 0) bytes += "\x7a" + std::string(1, static_cast<char>(random() % 128));  // a field beyond the end
  if (random() % 3 == 0) bytes += request.SerializeAsString();
  if (random() % 3 == 0) bytes.resize(random() % (bytes.size() + 1));
  if (random() % 3 == 0 && !bytes.empty()) bytes[random() % bytes.size()] = static_cast<char>(random());
  return bytes;
}

TEST(SignedRequest, NamesTheAskerWhateverTheRequestSaid) {
  std::mt19937 random(test::seed());
  int taken = 0;
  testing::internal::CaptureStderr();
  for (int i = 0; i < 20'000; ++i) {
    const std::string bytes = anything(random);
    const auto stated = signedRequest(bytes, "\"ada\" at 192.0.2.1");
    pb::Request before, after;
    EXPECT_EQ(stated.has_value(), before.ParseFromString(bytes));
    if (!stated) continue;
    ++taken;
    EXPECT_TRUE(after.ParseFromString(*stated));
    EXPECT_EQ(after.on_behalf_of(), "\"ada\" at 192.0.2.1");
    before.set_on_behalf_of(after.on_behalf_of());
    EXPECT_EQ(before.SerializeAsString(), after.SerializeAsString());
  }
  EXPECT_EQ(testing::internal::GetCapturedStderr(), "") << "nobody on the network writes the log";
  EXPECT_GT(taken, 1000);
}

TEST(SignedRequest, WhatALaterInstrumentUnderstandsIsKept) {
  const std::string later = "\x08\x01\xfa\x07\x03new";  // field 127
  const auto stated = signedRequest(later, "ada");
  ASSERT_TRUE(stated);
  EXPECT_NE(stated->find("\xfa\x07\x03new"), std::string::npos);
}

TEST(SignedRequest, LargerThanTheInstrumentTakesIsRefused) {
  pb::Request request;
  request.set_version(1);
  request.mutable_camera()->mutable_read()->set_name(std::string(65'536 - 20, 'x'));
  EXPECT_FALSE(signedRequest(request.SerializeAsString(), "somebody with a long name"));
}

}  // namespace
}  // namespace tractiond::gateway::request_test
