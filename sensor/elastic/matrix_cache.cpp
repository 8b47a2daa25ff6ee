#include "sensor/elastic/matrix_cache.h"

#include "base/hash.h"
#include "base/whole_file.h"

#include <array>
#include <cstdint>
#include <cstring>
#include <span>
#include <system_error>

namespace sensor::elastic {
namespace {

constexpr std::uint64_t kMagic = 0x326e697774636172;  // contains the version of the format

struct Head {
  std::uint64_t magic = kMagic, rows = 0, columns = 0;
  tractiond::Hash128 hash{};
};

std::filesystem::path pathOf(const std::filesystem::path& directory, const std::vector<double>& key) {
  return directory /
         ("gel-" + tractiond::toHex(tractiond::hash128(key.data(), sizeof(double) * key.size())) + ".matrix");
}

}  // namespace

std::optional<Eigen::MatrixXd> loadMatrix(const std::filesystem::path& directory, const std::vector<double>& key) {
  const auto content = tractiond::readWholeFile(pathOf(directory, key));
  Head head;
  if (!content || content->size() < sizeof head) return std::nullopt;
  std::memcpy(&head, content->data(), sizeof head);
  constexpr std::uint64_t kMost = 1U << 20U;
  const auto numbers = std::span(*content).subspan(sizeof head);
  if (head.magic != kMagic || head.rows > kMost || head.columns > kMost ||
      numbers.size() != sizeof(double) * head.rows * head.columns ||
      head.hash != tractiond::hash128(numbers.data(), numbers.size())) {
    return std::nullopt;
  }
  Eigen::MatrixXd matrix(head.rows, head.columns);
  std::memcpy(matrix.data(), numbers.data(), numbers.size());
  return matrix;
}

bool saveMatrix(const std::filesystem::path& directory, const std::vector<double>& key, const Eigen::MatrixXd& matrix) {
  const std::span numbers(reinterpret_cast<const char*>(matrix.data()), sizeof(double) * matrix.size());
  const Head head{kMagic, static_cast<std::uint64_t>(matrix.rows()), static_cast<std::uint64_t>(matrix.cols()),
                  tractiond::hash128(numbers.data(), numbers.size())};
  std::error_code error;
  std::filesystem::create_directories(directory, error);
  const std::array pieces = {std::span(reinterpret_cast<const char*>(&head), sizeof head), numbers};
  return !tractiond::replaceWholeFile(pathOf(directory, key), pieces);
}

}  // namespace sensor::elastic
