// Reads TOML key by key into plain values, and says what was wrong in words: file, line, key, nearest key.
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

namespace sensor {

/// What is wrong with a file.
struct FileError {
  std::string where;        ///< "paper.toml:12"
  std::string what;         ///< "gel.poisson_ratio = 0.5 is not below 0.5"
  bool unreadable = false;  ///< there was nothing to read: missing file, no permission
  bool isData = false;      ///< it holds numbers that programs write, not words
};

/// Values in the file may stand in another unit than in memory: in memory = in the file / perUnit.
struct Range {
  double least = 0.0, most = 0.0;  ///< allowed in the file, both included
  double perUnit = 1.0;
};

/// A table of a parsed file. Reading leaves a value as it is when its key is absent. The first fault is kept, and
/// finish() of any table of the file returns it. Thread-bound.
class TomlTable {
 public:
  static tl::expected<TomlTable, FileError> parse(std::string_view text, const std::string& file);
  static tl::expected<TomlTable, FileError> load(const std::string& path);

  void read(std::string_view key, double& value, const Range& range);
  void read(std::string_view key, int& value, const Range& range);
  void read(std::string_view key, bool& value);
  void read(std::string_view key, std::string& value);
  void read(std::string_view key, std::vector<std::string>& values);
  void read(std::string_view key, std::span<double> values, const Range& range);     ///< exactly as many
  void read(std::string_view key, std::vector<double>& values, const Range& range);  ///< or a single number
  std::optional<TomlTable> table(std::string_view key);
  std::vector<TomlTable> tables(std::string_view key);  ///< of an array of tables
  /// Every key of this table and its plain value, in the order of the file.
  using Scalar = std::variant<bool, std::int64_t, double, std::string>;
  std::vector<std::pair<std::string, Scalar>> entries();
  bool has(std::string_view key) const;

  /// A fault found by the caller, at a key (or the table itself where it has no such key).
  void fail(std::string_view key, const std::string& what);
  /// The first fault; then the first key of the whole file that nobody has read.
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

}  // namespace sensor
