// Writes what numpy.load() reads: a .npz of arrays whose sizes are known before.
#pragma once

#include <cstdint>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

namespace traction::cli {

/// The file cannot be written: what() says why.
class NpzError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Each array is filled row after row, all of them side by side, so that nothing but a row of each need be in memory.
/// Thread-bound.
class NpzWriter {
 public:
  struct Array {
    std::string name;
    std::string type;               ///< NumPy's: "<f8"
    std::uint64_t rows = 0;         ///< the first dimension
    std::vector<std::size_t> row;   ///< the others
    std::size_t element_bytes = 8;  ///< of one element

    std::size_t rowBytes() const;
  };

  /// Replaces the file. \throws NpzError
  NpzWriter(const std::string& path, const std::vector<Array>& arrays);
  ~NpzWriter();
  NpzWriter(const NpzWriter&) = delete;
  NpzWriter& operator=(const NpzWriter&) = delete;

  /// The next row of an array, little endian; by its place among them. \throws NpzError
  void add(std::size_t array, std::string_view row);
  /// After all rows of all arrays. \throws NpzError
  void finish();

 private:
  struct Member {
    std::string name;
    std::uint64_t start = 0;  ///< of its header in the file
    std::uint64_t next = 0;   ///< where the next bytes go
    std::uint64_t size = 0;   ///< of header and rows of the .npy
    std::uint32_t crc = 0;
    std::string waiting;  ///< not written yet
  };
  static std::string localHeader(const Member& member);
  void put(Member& member, std::string_view bytes);
  void flush(Member& member);
  void writeAt(std::uint64_t offset, std::string_view bytes) const;

  int fd_;
  std::vector<Member> members_;
  std::uint64_t end_ = 0;
};

}  // namespace traction::cli
