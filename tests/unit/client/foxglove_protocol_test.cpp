// The text and bytes of the Foxglove WebSocket protocol, and the checks of addresses and hosts. Expected bytes are
// those of the specification (https://github.com/foxglove/ws-protocol, docs/spec.md) and of RFC 4648.
#include "client/viewer/foxglove_protocol.h"
#include "client/viewer/listen_address.h"

#include <gtest/gtest.h>

#include <string>

namespace traction::view::foxglove {
namespace {

template <typename Wanted>
Wanted parsed(std::string_view text) {
  const ClientMessage message = parseText(text);
  const auto* wanted = std::get_if<Wanted>(&message);
  if (wanted != nullptr) return *wanted;
  const auto* refused = std::get_if<Refused>(&message);
  ADD_FAILURE() << text << ": " << (refused != nullptr ? refused->why : "another kind of message");
  return {};
}

TEST(FoxgloveProtocol, TheSpecificationsExamples) {
  const auto message = parsed<Subscribe>(R"({"op": "subscribe", "subscriptions": [{ "id": 0, "channelId": 3 },
                                                                       { "id": 4294967295, "channelId": 5, "x": {} }]})");
  ASSERT_EQ(message.subscriptions.size(), 2U);
  EXPECT_EQ(message.subscriptions[0].id, 0U);
  EXPECT_EQ(message.subscriptions[0].channel, 3U);
  EXPECT_EQ(message.subscriptions[1].id, 4294967295U);
  EXPECT_EQ(message.subscriptions[1].channel, 5U);
  EXPECT_TRUE(parsed<Subscribe>(R"({"subscriptions":[],"op":"subscribe"})").subscriptions.empty());
  EXPECT_EQ(parsed<Unsubscribe>(R"({"op": "unsubscribe", "subscriptionIds": [0, 1]})").ids,
            (std::vector<std::uint32_t>{0, 1}));
}

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
    EXPECT_NE(parsed<Refused>(text).why.find(why), std::string::npos)
        << text.substr(0, 80) << ": " << parsed<Refused>(text).why;
  }
}

TEST(FoxgloveProtocol, TheServersTexts) {
  EXPECT_EQ(serverInfo("traction-view \"1\"", "7"),
            R"({"capabilities":[],"name":"traction-view \"1\"","op":"serverInfo","sessionId":"7"})");
  EXPECT_EQ(advertise({}), R"({"channels":[],"op":"advertise"})");
  EXPECT_EQ(advertise({{.id = 9, .topic = "a/b/", .schemaName = "a.B", .schema = "fooba"}}),
            R"({"channels":[{"encoding":"protobuf","id":9,"schema":"Zm9vYmE=","schemaEncoding":"protobuf",)"
            R"("schemaName":"a.B","topic":"a/b/"}],"op":"advertise"})");
  EXPECT_EQ(errorStatus("x", "i"), R"({"id":"i","level":2,"message":"x","op":"status"})");
  EXPECT_EQ(errorStatus("x"), R"({"level":2,"message":"x","op":"status"})");
}

TEST(FoxgloveProtocol, TheHeaderOfDataIsLittleEndian) {
  const auto header = dataHeader(0x04030201, 0x0C0B0A0908070605);
  const std::string bytes(header.begin(), header.end());
  EXPECT_EQ(bytes, std::string("\x01\x01\x02\x03\x04\x05\x06\x07\x08\x09\x0A\x0B\x0C"));
}

TEST(FoxgloveProtocol, TheSubprotocolIsOneThatWasOffered) {
  EXPECT_EQ(chooseSubprotocol("foxglove.websocket.v1"), "foxglove.websocket.v1");
  EXPECT_EQ(chooseSubprotocol("foxglove.websocket.v1, foxglove.sdk.v1"), "foxglove.sdk.v1");
  EXPECT_EQ(chooseSubprotocol(" x ,\tfoxglove.websocket.v1 "), "foxglove.websocket.v1");
  for (const char* none : {"", ",", " , ", "foxglove.websocket.v2", "foxglove.websocket.v1x", "xfoxglove.sdk.v1"}) {
    EXPECT_EQ(chooseSubprotocol(none), "") << none;
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

TEST(ListenAddress, NamesAreResolved) {
  EXPECT_EQ(resolved("localhost"), "127.0.0.1");
  for (const char* address : {"10.0.0.1", "::1", "0.0.0.0"}) EXPECT_EQ(resolved(address), address);
  for (const char* none : {"", "no name", "127.0.0.1:1"}) EXPECT_EQ(resolved(none), "") << none;
}

TEST(ListenAddress, LoopbackAddresses) {
  for (const char* address : {"127.9.9.9", "::1"}) EXPECT_TRUE(isLoopback(address)) << address;
  for (const char* address : {"0.0.0.0", "::", "10.0.0.1", "localhost", ""})
    EXPECT_FALSE(isLoopback(address)) << address;
}

TEST(ListenAddress, HostsThatMayBeAnAttackersNameAreRefused) {
  for (const char* host :
       {"localhost", "localhost:8765", "127.0.0.1:1", "10.1.2.3", "[::1]", "[::1]:8765", "box", "box:1"}) {
    EXPECT_TRUE(isAllowedHost(host, {"box"})) << host;
  }
  for (const char* host :
       {"", "example.org", "localhost.example.org", "127.0.0.1.example.org", "[::1", "box.example.org"}) {
    EXPECT_FALSE(isAllowedHost(host, {"box"})) << host;
  }
}

}  // namespace
}  // namespace traction::view::foxglove
