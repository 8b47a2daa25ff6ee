// Recordings as other programs write them: chunks are compressed and hold the declarations, or parts are missing.
#pragma once

#include "recording/bytes.h"
#include "recording/records.h"

#include <lz4frame.h>
#include <zstd.h>

#include <functional>
#include <string>
#include <string_view>
#include <utility>

namespace recording {

inline std::string zstd(std::string_view bytes) {
  std::string packed(ZSTD_compressBound(bytes.size()), '\0');
  packed.resize(ZSTD_compress(packed.data(), packed.size(), bytes.data(), bytes.size(), 1));
  return packed;
}

/// Several frames, as a program that appends makes them.
inline std::string zstdFrames(std::string_view bytes) {
  return zstd(bytes.substr(0, bytes.size() / 2)) + zstd(bytes.substr(bytes.size() / 2));
}

inline std::string lz4(std::string_view bytes) {
  std::string packed(LZ4F_compressFrameBound(bytes.size(), nullptr), '\0');
  packed.resize(LZ4F_compressFrame(packed.data(), packed.size(), bytes.data(), bytes.size(), nullptr));
  return packed;
}

struct Foreign {
  std::function<void(Chunk& chunk, std::string& records)> onChunk = {};  ///< may change it; `records` are its records
  bool declaresInChunks = false;  ///< what Writer declares before a chunk is in it instead
  bool hasSummary = true;
};

/// Rewrites what Writer wrote. Indexes lead nowhere afterwards.
inline std::string rewritten(std::string_view bytes, const Foreign& how) {
  std::string made(kMagic), declared;
  bool isSummary = false;
  std::uint64_t summary = 0;
  for (Input in(bytes.substr(kMagic.size(), bytes.size() - 2 * kMagic.size())); !in.empty();) {
    const auto opcode = static_cast<Opcode>(in.number<std::uint8_t>());
    std::string content(in.bytes(in.number<std::uint64_t>()));
    const bool isDeclaration = opcode == Opcode::kSchema || opcode == Opcode::kChannel;
    if (opcode == Opcode::kFooter) {
      content.clear();
      Output(content).number(how.hasSummary ? summary : 0).number(std::uint64_t{0}).number(std::uint32_t{0});
    }
    std::string record;
    Output(record).number(static_cast<std::uint8_t>(opcode)).number(std::uint64_t{content.size()}).bytes(content);
    if (opcode == Opcode::kChunk) {
      Chunk chunk = *chunkOf(content);
      std::string records = std::exchange(declared, {}) + std::string(chunk.records);
      chunk.size = records.size();
      chunk.crc = crcOf(records);
      chunk.records = records;
      if (how.onChunk) how.onChunk(chunk, records);
      put(made, chunk);
    } else if (isDeclaration && how.declaresInChunks && !isSummary) {
      declared += record;
    } else if ((isSummary && !how.hasSummary && opcode != Opcode::kFooter) || opcode == Opcode::kSummaryOffset) {
      // left out
    } else {
      made += record;
    }
    if (opcode == Opcode::kDataEnd) {
      isSummary = true;
      summary = made.size();
    }
  }
  return made + std::string(kMagic);
}

/// Compresses each chunk.
inline Foreign compressedBy(std::string_view name, std::string (*pack)(std::string_view)) {
  return {.onChunk = [=](Chunk& chunk, std::string& records) {
    records = pack(records);
    chunk.compression = name;
    chunk.records = records;
  }};
}

}  // namespace recording
