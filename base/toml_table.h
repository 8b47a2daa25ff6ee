// Reads TOML key by key into plain values and describes faults in words: file, line, key, nearest known key.
#pragma once

#include <tl/expected.hpp>

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

namespace tractiond {

/// An error in a file.
struct FileError {
  std::string where;        ///< "paper.toml:12"
  std::string what;         ///< "gel.poisson_ratio = 0.5 is not below 0.5"
  bool unreadable = false;  ///< true: the file does not exist, is no regular file, or may not be read
  bool isData = false;      ///< true: the file holds numbers written by a program, not text
};

/// Allowed values of a number, and the unit in the file: value in memory = value in the file / perUnit.
struct Range {
  double least = 0.0, most = 0.0;  ///< inclusive bounds of the value in the file
  double perUnit = 1.0;
};

/// A table of a parsed file. Reading a missing key leaves the value unchanged. The first fault is kept, and finish() of
/// any table of the file returns it. Thread-bound.
class TomlTable {
 public:
  /// Parses `text`. \param file names the file in errors
  static tl::expected<TomlTable, FileError> parse(std::string_view text, const std::string& file);
  /// Parses the file at `path`, of at most 4 MiB.
  static tl::expected<TomlTable, FileError> load(const std::string& path);

  // Read the value of a key. A wrong type or an invalid value is a fault.
  void read(std::string_view key, double& value, const Range& range);
  void read(std::string_view key, int& value, const Range& range);
  void read(std::string_view key, bool& value);
  void read(std::string_view key, std::string& value);
  void read(std::string_view key, std::vector<std::string>& values);
  /// Reads a list of exactly as many numbers.
  void read(std::string_view key, std::span<double> values, const Range& range);
  /// Reads a list of any length, or a single number.
  void read(std::string_view key, std::vector<double>& values, const Range& range);
  /// Returns the table of a key; nothing if the key is missing, or is not a table, which is a fault.
  std::optional<TomlTable> table(std::string_view key);
  std::vector<TomlTable> tables(std::string_view key);  ///< of an array of tables; empty if the key is missing
  /// A value of entries().
  using Scalar = std::variant<bool, std::int64_t, double, std::string>;
  /// Returns all keys of this table with their values, in the order of the file. A value of another type is a fault.
  std::vector<std::pair<std::string, Scalar>> entries();
  /// Returns whether the table has the key. This does not count as reading it.
  bool has(std::string_view key) const;

  /// Adds a fault that the caller found, at a key, or at the table itself if it has no such key.
  void fail(std::string_view key, const std::string& what);
  /// Returns the first fault; if there is none, the first key of the whole file that was not read.
  tl::expected<void, FileError> finish();

 private:
  struct Document;
  TomlTable(std::shared_ptr<Document> document, const void* node, std::string path);
  const void* find(std::string_view key);
  template <typename Target>
  void numbers(std::string_view key, const Range& range, Target& target);

  std::shared_ptr<Document> document_;
  const void* table_;
  std::string path_;
};

}  // namespace tractiond
