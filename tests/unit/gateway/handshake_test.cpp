#include "gateway/handshake.h"

#include <gtest/gtest.h>

namespace tractiond::gateway::handshake_test {
namespace {

using Request = std::vector<std::string>;

const std::string kReader(32, 'r'), kController(32, 'c'), kStranger(32, 's');

const network::AllowedKey* allowed(const std::string& key) {
  static const network::AllowedKey reader{"rita", network::keyOfBytes(kReader), network::Permission::kRead};
  static const network::AllowedKey controller{"carl", network::keyOfBytes(kController), network::Permission::kControl};
  if (key == reader.key) return &reader;
  return key == controller.key ? &controller : nullptr;
}

Request request(const std::string& domain, const std::string& key) {
  return {"1.0", "42", domain, "192.0.2.7", "", "CURVE", key};
}

void expectLetIn(const Request& request, const std::string& user) {
  const HandshakeAnswer answer = answerHandshake(request, allowed);
  EXPECT_EQ(answer.parts, (std::array<std::string, 6>{"1.0", "42", "200", "", user, ""}));
  EXPECT_EQ(answer.refused, "");
}

void expectRefused(const Request& request, const std::string& why) {
  const HandshakeAnswer answer = answerHandshake(request, allowed);
  EXPECT_EQ(answer.parts, (std::array<std::string, 6>{"1.0", "42", "400", why, "", ""}));
  EXPECT_EQ(answer.refused, "a peer at 192.0.2.7 is refused: " + why);
}

TEST(Handshake, OnlyWhoMayControlHasPicturesAndRequests) {
  for (const std::string domain : {"stream", "latest", "preview", "control"}) {
    expectLetIn(request(domain, kController), "carl");
    expectRefused(request(domain, kStranger), "the key '" + network::keyOfBytes(kStranger) + "' is not allowed");
    if (domain == "stream" || domain == "latest") {
      expectLetIn(request(domain, kReader), "rita");
    } else {
      expectRefused(request(domain, kReader), "\"rita\" may only read");
    }
  }
}

TEST(Handshake, WhatIsNoHandshakeWithAKeyIsRefused) {
  Request other = request("stream", kController);
  other[5] = "PLAIN";
  expectRefused(other, "the key '" + network::keyOfBytes(kController) + "' is not allowed");
  expectRefused(request("stream", kController.substr(1)), "the key '' is not allowed");
  expectRefused(request("stream", network::keyOfBytes(kController)), "the key '' is not allowed");
  Request longer = request("stream", kController);
  longer.push_back("");
  expectRefused(longer, "the key '' is not allowed");
  Request shorter = request("stream", kController);
  shorter.pop_back();
  expectRefused(shorter, "the key '' is not allowed");
  EXPECT_EQ(answerHandshake({}, allowed).parts[2], "400");
}

}  // namespace
}  // namespace tractiond::gateway::handshake_test
