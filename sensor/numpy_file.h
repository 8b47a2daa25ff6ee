// Reads a NumPy .npz archive that numpy.savez() wrote.
#pragma once

#include "base/toml_table.h"

#include <tl/expected.hpp>

#include <cstddef>
#include <map>
#include <span>
#include <string>
#include <vector>

namespace sensor {

using tractiond::FileError;

/// An array in C order: the last index varies fastest.
struct NumpyArray {
  std::vector<std::size_t> shape;  ///< extents, each at least 1; empty for a single number
  std::vector<double> values;      ///< as many as the product of the extents
};

/// An archive in memory, with the CRC-32 of every member checked. Immutable; any thread may read it.
class NumpyFile {
 public:
  /// Reads an archive. Fails if the file cannot be read, is not an archive, or is truncated, damaged, compressed,
  /// encrypted or larger than 4 GiB, or holds a name twice. The error has `unreadable` if the file cannot be read, else
  /// `isData`.
  static tl::expected<NumpyFile, FileError> load(const std::string& path);
  NumpyFile(NumpyFile&&) = default;
  NumpyFile& operator=(NumpyFile&&) = default;

  /// Returns an array in C order. The file may hold it as float64 or float32, little endian, in C or Fortran order.
  /// Fails (`isData`) if the array is missing, empty or of another type, or if a value is not finite.
  /// \param name keyword of savez(), without ".npy"
  tl::expected<NumpyArray, FileError> numbers(const std::string& name) const;

  /// Returns whether there is an array of this name.
  bool has(const std::string& name) const { return members_.contains(name); }

  /// Returns a string (NumPy's types U, little endian, and S) up to its first NUL. Fails (`isData`) if it is missing,
  /// not a single string, or not ASCII. \param name as in numbers()
  tl::expected<std::string, FileError> text(const std::string& name) const;

  /// Returns an error (`isData`) at the archive's path, with the text "name what", for checks of the caller. An empty
  /// name is left out.
  FileError fault(const std::string& name, const std::string& what) const;

 private:
  struct Member;
  NumpyFile(std::string path, std::vector<char> bytes);
  tl::expected<void, FileError> readDirectory();
  tl::expected<Member, FileError> member(const std::string& name) const;

  std::string path_;
  std::vector<char> bytes_;
  std::map<std::string, std::span<const char>> members_;  ///< views into bytes_, whose memory stays in place when moved
};

}  // namespace sensor
