#include "recording/decompress.h"

#include <lz4frame.h>
#include <zstd.h>

#include <memory>
#include <new>

namespace recording {

namespace {

/// Returns the number of bytes that the compressed ones had, at most to.size(), or why they cannot be decompressed.
tl::expected<std::uint64_t, std::string> takeZstd(std::string_view packed, std::string& to) {
  const std::size_t size = ZSTD_decompress(to.data(), to.size(), packed.data(), packed.size());
  if (ZSTD_isError(size) != 0) return tl::unexpected(std::string("zstd: ") + ZSTD_getErrorName(size));
  return size;
}

/// As takeZstd().
tl::expected<std::uint64_t, std::string> takeLz4(std::string_view packed, std::string& to) {
  LZ4F_dctx* made = nullptr;
  if (LZ4F_isError(LZ4F_createDecompressionContext(&made, LZ4F_VERSION)) != 0) {
    return tl::unexpected(std::string("lz4: no memory"));
  }
  const std::unique_ptr<LZ4F_dctx, LZ4F_errorCode_t (*)(LZ4F_dctx*)> context(made, &LZ4F_freeDecompressionContext);
  std::size_t size = 0, missing = 1;
  while (!packed.empty()) {
    std::size_t written = to.size() - size, taken = packed.size();
    missing = LZ4F_decompress(context.get(), to.data() + size, &written, packed.data(), &taken, nullptr);
    if (LZ4F_isError(missing) != 0) return tl::unexpected(std::string("lz4: ") + LZ4F_getErrorName(missing));
    if (written == 0 && taken == 0) break;  // there is more than fits
    size += written;
    packed.remove_prefix(taken);
  }
  if (!packed.empty() || missing != 0) return tl::unexpected(std::string("lz4: too many or too few bytes"));
  return size;
}

}  // namespace

tl::expected<void, std::string> decompress(std::string_view compression, std::string_view packed, std::uint64_t size,
                                           std::string& to) {
  const bool isZstd = compression == "zstd";
  if (!isZstd && compression != "lz4") {
    return tl::unexpected(std::string("it is compressed by another method than zstd and lz4"));
  }
  try {
    to.resize(static_cast<std::size_t>(size));
  } catch (const std::bad_alloc&) {
    return tl::unexpected("there is no memory for its " + std::to_string(size) + " bytes");
  }
  const auto taken = isZstd ? takeZstd(packed, to) : takeLz4(packed, to);
  if (!taken) return tl::unexpected(taken.error());
  if (*taken != size) {
    return tl::unexpected("it decompresses to " + std::to_string(*taken) + " bytes, and says " + std::to_string(size));
  }
  return {};
}

}  // namespace recording
