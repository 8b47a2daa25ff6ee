// Reads a NumPy .npz archive that numpy.savez() wrote.
#pragma once

#include "base/toml_table.h"

#include <tl/expected.hpp>

#include <cstddef>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace sensor {

using tractiond::FileError;

/// An array in C order: the last index varies fastest.
struct NumpyArray {
  std::vector<std::size_t> shape;  ///< extents, each at least 1; empty for a single number
  std::vector<double> values;      ///< as many as the product of the extents; of no meaning after a fault
};

/// An archive in memory, with the CRC-32 of every member checked. The first fault of a file is kept, and finish()
/// returns it; what is read after it has no meaning. Thread-bound.
class NumpyFile {
 public:
  /// Reads an archive. Fails if the file cannot be read, is not an archive, or is truncated, damaged, compressed or
  /// larger than 4 GiB, or holds a name twice. The error has `unreadable` if the file cannot be read, else
  /// `isData`.
  static tl::expected<NumpyFile, FileError> load(const std::string& path);
  NumpyFile(NumpyFile&&) = default;
  NumpyFile& operator=(NumpyFile&&) = default;

  /// Returns an array in C order. The file may hold it as float64 or float32, little endian, in C or Fortran order.
  /// It is a fault if the array is missing, empty or of another type, or if a value is not finite.
  /// \param name keyword of savez(), without ".npy"
  NumpyArray numbers(const std::string& name);

  /// Returns whether there is an array of this name.
  bool has(const std::string& name) const { return members_.contains(name); }

  /// Returns a string (NumPy's type U, little endian) up to its first NUL. It is a fault if it is missing, not a single
  /// string, or not ASCII.
  /// \param name as in numbers()
  std::string text(const std::string& name);

  /// Adds a fault that the caller found: "name what". An empty name is left out.
  void fail(const std::string& name, const std::string& what);
  /// Fails with the first fault (`isData`, at the archive's path), if there is one.
  tl::expected<void, FileError> finish() const;

 private:
  struct Member;
  NumpyFile(std::string path, std::vector<char> bytes);
  void readDirectory();
  std::optional<Member> member(const std::string& name);

  std::string path_;
  std::optional<FileError> fault_;
  std::vector<char> bytes_;
  std::map<std::string, std::span<const char>> members_;  ///< views into bytes_, whose memory stays in place when moved
};

}  // namespace sensor
