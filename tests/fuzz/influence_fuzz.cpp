#include "sensor/influence_file.h"
#include "tests/fuzz/target.h"

#include <bit>
#include <cstring>

namespace fuzz {
namespace {

void put(std::string& bytes, std::uint64_t value, int count) {
  for (int i = 0; i < count; ++i) bytes.push_back(i < 8 ? static_cast<char>(value >> 8 * i) : '\0');
}

std::uint32_t crc32(std::string_view bytes) {
  std::uint32_t crc = ~0U;
  for (const char byte : bytes) {
    crc ^= static_cast<std::uint8_t>(byte);
    for (int i = 0; i < 8; ++i) crc = crc >> 1 ^ (crc & 1 ? 0xedb88320U : 0U);
  }
  return ~crc;
}

std::string array(const std::string& shape, std::size_t count) {
  std::string text = "{'descr': '<f8', 'fortran_order': False, 'shape': (" + shape + "), }", bytes = "\x93NUMPY";
  text.resize(118, ' ');
  put(bytes, 1, 1);
  put(bytes, 0, 1);
  put(bytes, text.size(), 2);
  bytes += text;
  for (std::size_t i = 0; i < count; ++i)
    put(bytes, std::bit_cast<std::uint64_t>(1e-3 * static_cast<double>(1 + i)), 8);
  return bytes;
}

/// As numpy.savez() stores them.
std::string archive(const std::vector<std::pair<std::string, std::string>>& files) {
  std::string bytes, directory;
  const auto fields = [](std::string& to, const std::string& name, const std::string& content) {
    put(to, 20, 2);
    put(to, 0, 8);  // flags, stored, time and date
    put(to, crc32(content), 4);
    put(to, content.size(), 4);
    put(to, content.size(), 4);
    put(to, name.size(), 2);
    put(to, 0, 2);
  };
  for (const auto& [name, content] : files) {
    const std::size_t offset = bytes.size();
    bytes += "PK\3\4";
    fields(bytes, name, content);
    bytes += name + content;
    directory += "PK\1\2";
    put(directory, 20, 2);
    fields(directory, name, content);
    put(directory, 0, 10);
    put(directory, offset, 4);
    directory += name;
  }
  const std::size_t offset = bytes.size();
  bytes += directory + "PK\5\6";
  put(bytes, 0, 4);
  put(bytes, files.size(), 2);
  put(bytes, files.size(), 2);
  put(bytes, directory.size(), 4);
  put(bytes, offset, 4);
  put(bytes, 0, 2);
  return bytes;
}

}  // namespace

std::vector<std::string> seeds() {
  return {archive({{"markers.npy", array("4, 3", 12)},
                   {"nodes.npy", array("2, 3", 6)},
                   {"influence.npy", array("12, 6", 72)},
                   {"youngs_modulus.npy", array("", 1)}})};
}

void feed(std::string_view bytes) {
  const MemoryFile file(bytes);
  if (auto body = sensor::loadBody(file.path())) {
    sensor::Sensor sensor;
    static_cast<void>(sensor::setBody(sensor, *std::move(body)));
  }
}

}  // namespace fuzz
