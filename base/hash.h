// 128-bit hashes for ids and checksums: XXH3. Not secure against an attacker.
#pragma once

#include <xxhash.h>

#include <array>
#include <cstdint>
#include <cstring>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>

namespace tractiond {

using Hash128 = std::array<std::uint8_t, 16>;

/// Converts a hash of the library to its 16 bytes, big endian.
inline Hash128 canonical(XXH128_hash_t number) {
  XXH128_canonical_t digits;
  XXH128_canonicalFromHash(&digits, number);
  Hash128 hash;
  std::memcpy(hash.data(), digits.digest, hash.size());
  return hash;
}

/// Hashes values one after another; the result depends on their bytes and order. Thread-bound.
class Hasher {
 public:
  Hasher()
      : state_(XXH3_createState(), &XXH3_freeState) {
    XXH3_128bits_reset(state_.get());
  }

  /// Adds bytes without their number.
  void bytes(const void* data, std::size_t size) { XXH3_128bits_update(state_.get(), data, size); }

  /// Adds the bytes of a number or enum, in the byte order of the machine. Does not compile for structs: their padding
  /// is not defined.
  template <typename T>
  requires std::is_arithmetic_v<T> || std::is_enum_v<T>
  void value(T value) { bytes(&value, sizeof value); }

  /// Adds the number of elements as 8 bytes, then the elements.
  template <typename T>
  requires std::is_arithmetic_v<T>
  void range(std::span<const T> values) {
    value(static_cast<std::uint64_t>(values.size()));
    bytes(values.data(), values.size_bytes());
  }
  /// Adds the number of bytes as 8 bytes, then the text.
  void text(std::string_view text) { range(std::span<const char>(text.data(), text.size())); }

  /// Returns the hash of everything added so far, big endian, as XXH3 prints it. More may be added afterwards.
  Hash128 digest() const { return canonical(XXH3_128bits_digest(state_.get())); }

 private:
  std::unique_ptr<XXH3_state_t, XXH_errorcode (*)(XXH3_state_t*)> state_;
};

/// Returns the hash of `size` bytes, which may be 0: that of a Hasher to which the same was added by bytes().
/// Reentrant; allocates nothing.
inline Hash128 hash128(const void* data, std::size_t size) {
  return canonical(XXH3_128bits(data, size));
}

/// Returns a hash as 32 lower-case hexadecimal digits.
inline std::string toHex(const Hash128& hash) {
  std::string text;
  for (const auto byte : hash) {
    text += "0123456789abcdef"[byte >> 4];
    text += "0123456789abcdef"[byte & 15];
  }
  return text;
}

}  // namespace tractiond
