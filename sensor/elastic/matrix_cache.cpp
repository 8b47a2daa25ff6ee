#include "sensor/elastic/matrix_cache.h"

#include "base/whole_file.h"

#include <array>
#include <cstdint>
#include <cstring>
#include <span>

namespace sensor::elastic {

namespace {

constexpr std::uint64_t kMagic = 0x316e697774636172;  // contains the version of the format

std::span<const char> bytes(const double* numbers, std::size_t count) {
  return {reinterpret_cast<const char*>(numbers), sizeof(double) * count};
}

std::uint64_t fowlerNollVo(std::span<const char> data, std::uint64_t hash = 0xcbf29ce484222325U) {
  for (const char byte : data) hash = (hash ^ static_cast<unsigned char>(byte)) * 0x100000001b3U;
  return hash;
}

struct Head {
  std::uint64_t magic = kMagic, keySize = 0, rows = 0, columns = 0, hash = 0;
};

std::filesystem::path pathOf(const std::filesystem::path& directory, std::span<const char> key) {
  std::array<char, 40> name{};
  std::snprintf(name.data(), name.size(), "gel-%016llx.matrix", static_cast<unsigned long long>(fowlerNollVo(key)));
  return directory / name.data();
}

}  // namespace

std::optional<Eigen::MatrixXd> loadMatrix(const std::filesystem::path& directory, const std::vector<double>& key) {
  const auto keyBytes = bytes(key.data(), key.size());
  const auto content = tractiond::readWholeFile(pathOf(directory, keyBytes));
  Head head;
  if (!content || content->size() < sizeof head + keyBytes.size()) return std::nullopt;
  std::memcpy(&head, content->data(), sizeof head);
  constexpr std::uint64_t kMost = 1U << 20U;
  const std::span whole(*content), numbers = whole.subspan(sizeof head + keyBytes.size());
  if (head.magic != kMagic || head.keySize != key.size() || head.rows > kMost || head.columns > kMost ||
      numbers.size() != sizeof(double) * head.rows * head.columns ||
      std::memcmp(&whole[sizeof head], keyBytes.data(), keyBytes.size()) != 0 ||
      head.hash != fowlerNollVo(whole.subspan(sizeof head))) {
    return std::nullopt;
  }
  Eigen::MatrixXd matrix(head.rows, head.columns);
  std::memcpy(matrix.data(), numbers.data(), numbers.size());
  return matrix;
}

bool saveMatrix(const std::filesystem::path& directory, const std::vector<double>& key, const Eigen::MatrixXd& matrix) {
  const auto keyBytes = bytes(key.data(), key.size()), numbers = bytes(matrix.data(), matrix.size());
  const Head head{kMagic, key.size(), static_cast<std::uint64_t>(matrix.rows()),
                  static_cast<std::uint64_t>(matrix.cols()), fowlerNollVo(numbers, fowlerNollVo(keyBytes))};
  std::error_code error;
  std::filesystem::create_directories(directory, error);
  const std::array pieces = {std::span<const char>(reinterpret_cast<const char*>(&head), sizeof head), keyBytes,
                             numbers};
  return !tractiond::replaceWholeFile(pathOf(directory, keyBytes), pieces);
}

}  // namespace sensor::elastic
