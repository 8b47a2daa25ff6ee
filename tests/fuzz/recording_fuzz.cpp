#include "recording/reader.h"
#include "recording/writer.h"
#include "tests/fuzz/target.h"
#include "tests/unit/recording/foreign_recording.h"

namespace fuzz {

namespace {

class Memory : public recording::Sink {
 public:
  tl::expected<void, recording::Error> append(std::string_view added, std::uint64_t) override {
    bytes += added;
    return {};
  }
  tl::expected<void, recording::Error> sync() override { return {}; }

  std::string bytes;
};

}  // namespace

std::vector<std::string> seeds() {
  Memory empty, some;
  static_cast<void>(recording::Writer(empty, {}).close());
  recording::Writer writer(some, {.chunkTime_ns = 20, .library = "fuzz"});
  const auto schema = writer.schema("a.B", "protobuf", "bytes");
  const auto one = writer.channel(schema, "a/b/", "protobuf", {{"sensor", "gel"}}),
             other = writer.channel(0, "c/", "json");
  for (unsigned i = 0; i < 6; ++i) {
    static_cast<void>(writer.write({i % 2 == 0 ? one : other, i, 10 * i, 9 * i, "some bytes of a message"}));
  }
  static_cast<void>(writer.close());
  return {empty.bytes, some.bytes, some.bytes.substr(0, some.bytes.size() / 2),
          recording::rewritten(some.bytes, recording::compressedBy("zstd", recording::zstd)),
          recording::rewritten(some.bytes, recording::compressedBy("lz4", recording::lz4))};
}

bool feed(std::string_view bytes) {
  const MemoryFile file(bytes);
  const auto reader = recording::Reader::open(file.path());
  if (!reader) return false;
  static_cast<void>(reader->summary());
  std::size_t messages = 0, again = 0;
  const auto count = [](std::size_t& counter) {
    return [&counter](const recording::Channel&, const recording::Schema*, const recording::Message&) { ++counter; };
  };
  const auto extent = reader->read(count(messages));
  require(extent.has_value() && extent->whole_bytes <= bytes.size(), "more was read than there is");
  Memory memory;
  require(recover(*reader, memory).has_value(), "a recording cannot be recovered");
  const MemoryFile recovered(memory.bytes);
  const auto whole = recording::Reader::open(recovered.path())->read(count(again));
  require(whole && whole->isWhole() && again == messages, "what was recovered is not whole");
  return true;
}

}  // namespace fuzz
