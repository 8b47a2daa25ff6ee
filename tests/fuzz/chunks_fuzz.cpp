#include "daemon/capture/chunk_reader.h"
#include "tests/fuzz/target.h"

#include <array>

namespace fuzz {

std::vector<std::string> seeds() {
  const auto word = [](unsigned value) {
    return std::string{static_cast<char>(value >> 24), static_cast<char>(value >> 16), static_cast<char>(value >> 8),
                       static_cast<char>(value)};
  };
  return {std::string(32, 'p') + word(1) + word(32) + std::string(8, '\0') + word(2) + word(8)};
}

bool feed(std::string_view bytes) {
  using tractiond::capture::ChunkField;
  static const std::array<ChunkField, 3> kFields = {
      {{.meaning = ChunkField::Meaning::kExposure_us, .chunk = 2, .length = 8, .isFloat = true},
       {.meaning = ChunkField::Meaning::kFrameId, .chunk = 2, .offset = 3, .length = 5},
       {.meaning = ChunkField::Meaning::kTimestamp_ns, .chunk = 1, .offset = 30, .length = 8}}};
  const std::vector<std::uint8_t> buffer(bytes.begin(), bytes.end());  // with an end of its own
  bool taken = false;
  for (const bool bigEndian : {true, false}) {
    tractiond::capture::Chunks chunks;
    const auto picture = tractiond::capture::readChunks(buffer, 32, bigEndian, kFields, chunks);
    require(!picture || (*picture >= 32 && *picture <= buffer.size()), "a picture that is not in the buffer");
    taken = taken || picture;
  }
  return taken;
}

}  // namespace fuzz
