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
  bool unreadable = false;  ///< true: the file does not exist, is no regular file, is too large, or may not be read
  bool isData = false;      ///< true: the file holds numbers written by a program, not text
};

/// Allowed values of a number, and the unit in the file: value in memory = value in the file / perUnit.
struct Range {
  double least = 0.0, most = 0.0;  ///< inclusive bounds of the value in the file
  double perUnit = 1.0;
};

/// A table of a parsed file. Reading a missing key leaves the value unchanged, and is no fault. The first fault is
/// kept, and finish() of any table of the file returns it. Tables of one file share its contents, which live as long as
/// one of them. Thread-bound.
class TomlTable {
 public:
  /// Parses `text`, which need not outlive the call. Skips a byte order mark of UTF-8. Fails if it is not TOML in
  /// UTF-8, or if a key, or the text of a line, has more than 100 parts between dots. Returns the root table.
  /// \param file names the file in errors
  static tl::expected<TomlTable, FileError> parse(std::string_view text, const std::string& file);
  /// Parses the file at `path`, of at most 4 MiB. Fails as parse(), and with FileError::unreadable if it cannot be
  /// read.
  static tl::expected<TomlTable, FileError> load(const std::string& path);

  // Read the value of a key. A wrong type or a number that is not finite or not in its range is a fault, which leaves
  // the value unchanged. An int needs a number without a point, and a range that an int can hold.
  void read(std::string_view key, double& value, const Range& range);
  void read(std::string_view key, int& value, const Range& range);
  void read(std::string_view key, bool& value);
  void read(std::string_view key, std::string& value);
  void read(std::string_view key, std::vector<std::string>& values);
  /// Reads a list of exactly as many numbers as `values` has. Another number of them is a fault.
  void read(std::string_view key, std::span<double> values, const Range& range);
  /// Reads a list of any length, or a single number.
  void read(std::string_view key, std::vector<double>& values, const Range& range);
  /// Returns the table of a key; nothing if the key is missing, or is not a table, which is a fault.
  std::optional<TomlTable> table(std::string_view key);
  /// Returns the tables of an array of tables, in the order of the file; none if the key is missing, or is not such an
  /// array, which is a fault.
  std::vector<TomlTable> tables(std::string_view key);
  /// A value of entries().
  using Scalar = std::variant<bool, std::int64_t, double, std::string>;
  /// Returns all keys of this table with their values, in the order of the file. A value of another type is a fault,
  /// and is left out.
  std::vector<std::pair<std::string, Scalar>> entries();
  /// Returns whether the table has the key. This does not count as reading it.
  bool has(std::string_view key) const;

  /// Adds a fault that the caller found, at the line of a key, or of the table itself if it has no such key. Has no
  /// effect if there is a fault already.
  /// \param what completes a sentence that begins with the key: "must be even"
  void fail(std::string_view key, const std::string& what);
  /// Fails with the first fault; if there is none, with the first key of the whole file that was not read, an unknown
  /// one. Must be called when all known keys have been read.
  /// \param isStrict false: unknown keys are no fault
  tl::expected<void, FileError> finish(bool isStrict = true);

 private:
  struct Document;
  TomlTable(std::shared_ptr<Document> document, const void* node, std::string path);
  const void* find(std::string_view key);
  /// Returns a list of `count` numbers; without a count of any length, or a single number. Nothing if there is none, or
  /// a fault.
  std::optional<std::vector<double>> numbers(std::string_view key, const Range& range,
                                             std::optional<std::size_t> count);

  std::shared_ptr<Document> document_;
  const void* table_;
  std::string path_;
};

/// Returns a text as a TOML string, with quotes. Control characters become \uXXXX; a backslash is put before quotes and
/// backslashes. Bytes that are not UTF-8 are kept, which TOML does not allow.
std::string quoted(const std::string& text);

}  // namespace tractiond
