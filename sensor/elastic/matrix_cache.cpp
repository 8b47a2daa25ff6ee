#include "sensor/elastic/matrix_cache.h"

#include <unistd.h>

#include <array>
#include <cstdint>
#include <fstream>
#include <span>
#include <string>

namespace sensor::elastic {

namespace {

constexpr std::uint64_t kMagic = 0x316e697774636172;  // contains the version of the format

template <typename Number>
std::span<const std::byte> bytes(std::span<const Number> numbers) {
  return std::as_bytes(numbers);
}

std::uint64_t fowlerNollVo(std::span<const std::byte> data, std::uint64_t hash = 0xcbf29ce484222325U) {
  for (const std::byte byte : data) hash = (hash ^ static_cast<std::uint64_t>(byte)) * 0x100000001b3U;
  return hash;
}

struct Head {
  std::uint64_t magic = kMagic, keySize = 0, rows = 0, columns = 0, hash = 0;
};

std::filesystem::path pathOf(const std::filesystem::path& directory, const std::vector<double>& key) {
  std::array<char, 40> name{};
  std::snprintf(name.data(), name.size(), "gel-%016llx.matrix",
                static_cast<unsigned long long>(fowlerNollVo(bytes(std::span(key)))));
  return directory / name.data();
}

std::uint64_t hashOf(const std::vector<double>& key, const Eigen::MatrixXd& matrix) {
  return fowlerNollVo(bytes(std::span(matrix.data(), static_cast<std::size_t>(matrix.size()))),
                      fowlerNollVo(bytes(std::span(key))));
}

void read(std::istream& stream, void* to, std::size_t size) {
  stream.read(static_cast<char*>(to), static_cast<std::streamsize>(size));
}

void write(std::ostream& stream, const void* from, std::size_t size) {
  stream.write(static_cast<const char*>(from), static_cast<std::streamsize>(size));
}

}  // namespace

std::optional<Eigen::MatrixXd> loadMatrix(const std::filesystem::path& directory, const std::vector<double>& key) {
  const std::filesystem::path path = pathOf(directory, key);
  std::error_code error;
  const std::uintmax_t size = std::filesystem::file_size(path, error);
  std::ifstream stream(path, std::ios::binary);
  Head head;
  read(stream, &head, sizeof head);
  if (error || !stream || head.magic != kMagic || head.keySize != key.size()) return std::nullopt;
  constexpr std::uint64_t kMost = 1U << 20U;
  if (head.rows > kMost || head.columns > kMost ||
      size != sizeof head + sizeof(double) * (key.size() + head.rows * head.columns)) {
    return std::nullopt;
  }
  std::vector<double> storedKey(key.size());
  Eigen::MatrixXd matrix(head.rows, head.columns);
  read(stream, storedKey.data(), sizeof(double) * key.size());
  read(stream, matrix.data(), sizeof(double) * static_cast<std::size_t>(matrix.size()));
  if (!stream || storedKey != key || head.hash != hashOf(key, matrix)) return std::nullopt;
  return matrix;
}

bool saveMatrix(const std::filesystem::path& directory, const std::vector<double>& key, const Eigen::MatrixXd& matrix) {
  const std::filesystem::path path = pathOf(directory, key);
  std::filesystem::path draft = path;
  draft += "." + std::to_string(getpid());
  std::error_code error;
  std::filesystem::create_directories(directory, error);
  {
    std::ofstream stream(draft, std::ios::binary);
    const Head head{kMagic, key.size(), static_cast<std::uint64_t>(matrix.rows()),
                    static_cast<std::uint64_t>(matrix.cols()), hashOf(key, matrix)};
    write(stream, &head, sizeof head);
    write(stream, key.data(), sizeof(double) * key.size());
    write(stream, matrix.data(), sizeof(double) * static_cast<std::size_t>(matrix.size()));
    stream.close();
    if (!stream) error = std::make_error_code(std::errc::io_error);
  }
  if (!error) std::filesystem::rename(draft, path, error);
  if (!error) return true;
  std::error_code ignored;
  std::filesystem::remove(draft, ignored);
  return false;
}

}  // namespace sensor::elastic
