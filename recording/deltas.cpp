#include "recording/deltas.h"

#include <zlib.h>

#include <algorithm>

namespace recording {

bool packDeltas(std::string_view bytes, std::size_t delta, std::string& scratch, std::string& to) {
  delta = std::max<std::size_t>(delta, 1);
  scratch.resize(bytes.size());
  for (std::size_t i = 0; i < bytes.size(); ++i) {
    const auto before = i < delta ? 0U : static_cast<unsigned char>(bytes[i - delta]);
    scratch[i] = static_cast<char>(static_cast<unsigned char>(bytes[i]) - before);
  }
  z_stream stream{};
  // Huffman codes of single bytes only: noise has no repeated strings, and searching for them takes ten times as long.
  if (deflateInit2(&stream, Z_DEFAULT_COMPRESSION, Z_DEFLATED, MAX_WBITS, MAX_MEM_LEVEL, Z_HUFFMAN_ONLY) != Z_OK)
    return false;
  to.resize(deflateBound(&stream, static_cast<uLong>(scratch.size())));
  stream.next_in = reinterpret_cast<Bytef*>(scratch.data());
  stream.avail_in = static_cast<uInt>(scratch.size());
  stream.next_out = reinterpret_cast<Bytef*>(to.data());
  stream.avail_out = static_cast<uInt>(to.size());
  const bool whole = deflate(&stream, Z_FINISH) == Z_STREAM_END;
  to.resize(stream.total_out);
  deflateEnd(&stream);
  return whole;
}

namespace {

/// Returns whether the stream is whole and has exactly as many bytes as `to`.
bool inflateAll(std::string_view packed, std::span<std::uint8_t> to) {
  uLongf size = to.size();
  uLong taken = packed.size();
  const int done = uncompress2(to.data(), &size, reinterpret_cast<const Bytef*>(packed.data()), &taken);
  return done == Z_OK && size == to.size() && taken == packed.size();
}

}  // namespace

bool unpackDeltas(std::string_view packed, std::size_t delta, std::span<std::uint8_t> to) {
  if (delta == 0 || !inflateAll(packed, to)) {
    std::ranges::fill(to, std::uint8_t{0});
    return false;
  }
  for (std::size_t i = delta; i < to.size(); ++i) to[i] = static_cast<std::uint8_t>(to[i] + to[i - delta]);
  return true;
}

}  // namespace recording
