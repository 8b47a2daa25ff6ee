// What clients of the Foxglove WebSocket protocol send, and addresses to listen at.
#include "client/viewer/foxglove_protocol.h"
#include "client/viewer/listen_address.h"

#include <gtest/gtest.h>

#include <string>

namespace traction::view::foxglove {
namespace {

TEST(FoxgloveProtocol, MalformedMessagesAreRefusedWithAReason) {
  for (const auto& [text, why] : std::initializer_list<std::pair<std::string, std::string>>{
           {"", "not JSON"},
           {"[]", "'op'"},
           {"{}", "'op'"},
           {R"({"op":"subscribe"})", "'subscriptions'"},
           {R"({"op":"subscribe","subscriptions":{}})", "'subscriptions'"},
           {R"({"op":"subscribe","subscriptions":[1]})", "not an object"},
           {R"({"op":"subscribe","subscriptions":[{"id":1}]})", "'channelId'"},
           {R"({"op":"subscribe","subscriptions":[{"id":-1,"channelId":0}]})", "2^32 - 1"},
           {R"({"op":"subscribe","subscriptions":[{"id":1.5,"channelId":0}]})", "2^32 - 1"},
           {R"({"op":"subscribe","subscriptions":[{"id":4294967296,"channelId":0}]})", "2^32 - 1"},
           {R"({"op":"subscribe","subscriptions":[{"id":"1","channelId":0}]})", "2^32 - 1"},
           {R"({"op":"unsubscribe"})", "'subscriptionIds'"},
           {R"({"op":"unsubscribe","subscriptionIds":[true]})", "2^32 - 1"},
           {R"({"op":"dance"})", "unknown op 'dance'"},
           {std::string(10000, '[') + std::string(10000, ']'), "'op'"}}) {
    const ClientMessage message = parseText(text);
    const auto* refused = std::get_if<Refused>(&message);
    ASSERT_NE(refused, nullptr) << text.substr(0, 80);
    EXPECT_NE(refused->why.find(why), std::string::npos) << text.substr(0, 80) << ": " << refused->why;
  }
}

TEST(FoxgloveProtocol, OriginsOfWebPagesAreRefusedUnlessTheyAreNamed) {
  for (const char* origin :
       {"", "https://app.foxglove.dev", "https://studio.foxglove.dev", "https://lichtblick-suite.github.io", "file://",
        "app://foxglove", "http://localhost:8080"}) {
    EXPECT_TRUE(isAllowedOrigin(origin, {"http://localhost:8080"})) << origin;
  }
  for (const char* origin : {"null", "http://localhost", "http://localhost:8080", "https://example.org",
                             "https://app.foxglove.dev.example.org", "http://app.foxglove.dev",
                             "https://app.foxglove.dev:444", "https://evil.github.io", "https://file://", "*"}) {
    EXPECT_FALSE(isAllowedOrigin(origin, {"http://localhost:8081"})) << origin;
  }
}

TEST(ListenAddress, FormsOfTheCommandLine) {
  const ListenAddress defaults{.address = "127.0.0.1", .port = 8765};
  const auto parse = [&](const std::string& text) {
    const auto at = parseListenAddress(text, defaults);
    return at ? at->address + " " + std::to_string(at->port) : "none";
  };
  EXPECT_EQ(parse("9000"), "127.0.0.1 9000");
  EXPECT_EQ(parse("0"), "127.0.0.1 0");
  EXPECT_EQ(parse("10.0.0.1"), "10.0.0.1 8765");
  EXPECT_EQ(parse("10.0.0.1:65535"), "10.0.0.1 65535");
  EXPECT_EQ(parse("[::1]:9000"), "::1 9000");
  EXPECT_EQ(parse("[::1]"), "::1 8765");
  EXPECT_EQ(parse("::1"), "::1 8765");
  for (const char* none : {"", "65536", "10.0.0.1:", "10.0.0.1:x", "10.0.0.1:70000", ":9000000"}) {
    EXPECT_EQ(parse(none), "none") << none;
  }
}

}  // namespace
}  // namespace traction::view::foxglove
