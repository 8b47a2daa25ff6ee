#include "gateway/request.h"
#include "traction/v1/control.pb.h"

#include <gtest/gtest.h>

namespace tractiond::gateway::request_test {
namespace {

namespace pb = traction::v1;

/// Whatever bytes come: tests/fuzz/signed_request_fuzz.cpp.
TEST(SignedRequest, NamesTheAskerWhateverTheRequestSaid) {
  pb::Request request;
  request.set_version(1);
  request.mutable_zero()->set_anyway(true);
  request.set_on_behalf_of("the queen");
  const auto stated = signedRequest(request.SerializeAsString(), "\"ada\" at 192.0.2.1");
  ASSERT_TRUE(stated);
  request.set_on_behalf_of("\"ada\" at 192.0.2.1");
  EXPECT_EQ(*stated, request.SerializeAsString());
  testing::internal::CaptureStderr();
  EXPECT_FALSE(signedRequest("\xff\xff", "ada"));
  EXPECT_EQ(testing::internal::GetCapturedStderr(), "") << "nobody on the network writes the log";
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
