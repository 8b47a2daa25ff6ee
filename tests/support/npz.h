// Makes .npz archives as numpy.savez() does, and damaged ones that it never writes.
#pragma once

#include <zlib.h>

#include <cstdint>
#include <cstring>
#include <string>
#include <utility>
#include <vector>

namespace npz {

/// Returns the bytes of an integer, little endian.
template <typename T>
std::string bytesOf(T value) {
  std::string bytes;
  for (std::size_t i = 0; i < sizeof value; ++i) bytes += static_cast<char>(value >> (8 * i) & 0xff);
  return bytes;
}

template <typename T>
std::string bytesOf(const std::vector<T>& values) {
  std::string bytes(values.size() * sizeof(T), '\0');
  if (!values.empty()) std::memcpy(bytes.data(), values.data(), bytes.size());
  return bytes;
}

/// Returns the content of a .npy file.
/// \param type such as "<f8"
/// \param shape such as "3, 4" or "3,"; empty: a single element
/// \param data bytes of the elements; nothing is checked
inline std::string array(const std::string& type, const std::string& shape, const std::string& data,
                         bool fortran = false) {
  const std::string dictionary =
      "{'descr': '" + type + "', 'fortran_order': " + (fortran ? "True" : "False") + ", 'shape': (" + shape + "), }\n";
  return std::string("\x93NUMPY\x01\x00", 8) + bytesOf(static_cast<std::uint16_t>(dictionary.size())) + dictionary +
         data;
}

inline std::string numbers(const std::string& shape, const std::vector<double>& values) {
  return array("<f8", shape, bytesOf(values));
}

/// Returns the .npy content of a string without dimensions, in UTF-32.
/// \param text ASCII
inline std::string text(const std::string& text) {
  std::string data;
  for (const char c : text) data += c + std::string(3, '\0');
  return array("<U" + std::to_string(text.size()), "", data);
}

struct Member {
  std::string name, content;
  std::uint16_t flags = 0, method = 0;
};

inline std::string archive(const std::vector<Member>& members) {
  std::string file, directory;
  for (const Member& member : members) {
    const auto size = static_cast<std::uint32_t>(member.content.size());
    const auto* data = reinterpret_cast<const Bytef*>(member.content.data());
    const auto checksum = static_cast<std::uint32_t>(crc32(0, data, size));
    const std::string extra(20, '\0');  // as NumPy, which always leaves room for larger sizes
    const std::string name = member.name + ".npy";
    const auto common = [&](std::size_t extraSize) {
      return bytesOf(std::uint16_t{20}) + bytesOf(member.flags) + bytesOf(member.method) + bytesOf(std::uint32_t{0}) +
             bytesOf(checksum) + bytesOf(size) + bytesOf(size) + bytesOf(static_cast<std::uint16_t>(name.size())) +
             bytesOf(static_cast<std::uint16_t>(extraSize));
    };
    directory += std::string("PK\x01\x02") + bytesOf(std::uint16_t{20}) + common(0) + std::string(10, '\0') +
                 bytesOf(static_cast<std::uint32_t>(file.size())) + name;
    file += std::string("PK\x03\x04") + common(extra.size()) + name + extra + member.content;
  }
  const auto count = static_cast<std::uint16_t>(members.size());
  return file + directory + std::string("PK\x05\x06") + std::string(4, '\0') + bytesOf(count) + bytesOf(count) +
         bytesOf(static_cast<std::uint32_t>(directory.size())) + bytesOf(static_cast<std::uint32_t>(file.size())) +
         std::string(2, '\0');
}

}  // namespace npz
