// Writes .npz archives for numpy.load(), of arrays whose sizes are known in advance.
#pragma once

#include <cstdint>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

namespace traction::client {

/// The file cannot be written; what() is the reason.
class NpzError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Writes several arrays side by side, row by row, so that only a small part of each is in memory. Thread-bound.
class NpzWriter {
 public:
  struct Array {
    std::string name;
    std::string type;               ///< NumPy type: "<f8"
    std::uint64_t rows = 0;         ///< first dimension
    std::vector<std::size_t> row;   ///< other dimensions; empty: one element per row
    std::size_t element_bytes = 8;  ///< size of one element

    std::size_t rowBytes() const;  ///< size of one row [bytes]
  };

  /// Creates or replaces the file, which is no valid archive until finish(). \throws NpzError
  NpzWriter(const std::string& path, const std::vector<Array>& arrays);
  /// Closes the file. Without finish() it stays there, incomplete.
  ~NpzWriter();
  NpzWriter(const NpzWriter&) = delete;
  NpzWriter& operator=(const NpzWriter&) = delete;

  /// Adds the next row of an array. Rows are written to disk in pieces of some 64 KiB. \param array index in the
  /// constructor's list \param row exactly rowBytes() bytes, little endian: this is not checked
  /// \throws NpzError
  void add(std::size_t array, std::string_view row);
  /// Completes and closes the file; nothing can be added afterwards. All rows of all arrays must have been added: this
  /// is not checked. \throws NpzError
  void finish();

 private:
  struct Member {
    std::string name;
    std::uint64_t start = 0;  ///< offset of its header in the file
    std::uint64_t next = 0;   ///< offset of the next bytes
    std::uint64_t size = 0;   ///< size of the .npy header and rows
    std::uint32_t crc = 0;
    std::string waiting;  ///< bytes not written yet
  };
  static std::string localHeader(const Member& member);
  void put(Member& member, std::string_view bytes);
  void flush(Member& member);
  void writeAt(std::uint64_t offset, std::string_view bytes) const;

  int fd_;
  std::vector<Member> members_;
  std::uint64_t end_ = 0;
};

}  // namespace traction::client
