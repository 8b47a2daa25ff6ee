// A NumPy .npz archive, as numpy.savez() writes it.
#pragma once

#include "sensor/toml_table.h"

#include <tl/expected.hpp>

#include <cstddef>
#include <map>
#include <span>
#include <string>
#include <vector>

namespace sensor {

/// An array of numbers in C order: the last index runs fastest.
struct NumpyArray {
  std::vector<std::size_t> shape;
  std::vector<double> values;
};

/// The archive in memory; every member's CRC-32 is right. Immutable, any thread may read it.
class NumpyFile {
 public:
  /// Fails where there is nothing to read, and for what is no archive, is cut short, damaged, compressed or encrypted.
  static tl::expected<NumpyFile, FileError> load(const std::string& path);
  NumpyFile(NumpyFile&&) = default;
  NumpyFile& operator=(NumpyFile&&) = default;

  /// float64 or float32, little endian, C or Fortran order, all finite.
  tl::expected<NumpyArray, FileError> numbers(const std::string& name) const;

  /// A string of ASCII.
  tl::expected<std::string, FileError> text(const std::string& name) const;

  /// What is wrong with an array, for the caller's own checks.
  FileError fault(const std::string& name, const std::string& what) const;

 private:
  struct Member;
  NumpyFile(std::string path, std::vector<char> bytes);
  tl::expected<void, FileError> readDirectory();
  tl::expected<Member, FileError> member(const std::string& name) const;

  std::string path_;
  std::vector<char> bytes_;
  std::map<std::string, std::span<const char>> members_;  ///< into bytes_, which stays where it is when moved
};

}  // namespace sensor
