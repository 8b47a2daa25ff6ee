#include "base/toml_table.h"

#include "base/spelling.h"
#include "base/whole_file.h"

#include <pthread.h>
#include <toml++/toml.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <map>
#include <new>
#include <utility>

namespace tractiond {

namespace {

std::string text(double value) {
  std::array<char, 32> buffer{};
  std::snprintf(buffer.data(), buffer.size(), "%.10g", value);
  return buffer.data();
}

/// Returns a number as a double. toml++ returns nothing for integers that a double cannot hold exactly.
double numberIn(const toml::node& node) {
  const auto* const integer = node.as_integer();
  return integer != nullptr ? static_cast<double>(integer->get()) : node.as_floating_point()->get();
}

constexpr int kDeepest = 100;

/// Returns the line of a node that is in more than kDeepest tables and lists; 0 if there is none.
toml::source_index lineOfTooDeep(const toml::table& root) {
  std::vector<std::pair<const toml::node*, int>> open{{&root, 0}};
  while (!open.empty()) {
    const auto [node, depth] = open.back();
    open.pop_back();
    if (depth > kDeepest) return node->source().begin.line;
    if (const toml::table* table = node->as_table()) {
      for (const auto& [key, inner] : *table) open.emplace_back(&inner, depth + 1);
    } else if (const toml::array* array = node->as_array()) {
      for (const toml::node& inner : *array) open.emplace_back(&inner, depth + 1);
    }
  }
  return 0;
}

/// Calls `work`, which must not throw, on a thread with a stack of so many bytes, and waits for it. Returns false if
/// there is none.
template <typename Work>
bool onStackOf(std::size_t bytes, Work work) {
  pthread_attr_t attributes;
  pthread_t thread{};
  pthread_attr_init(&attributes);
  const auto run = [](void* what) -> void* { return (*static_cast<Work*>(what))(), nullptr; };
  const bool started = pthread_attr_setstacksize(&attributes, bytes) == 0 &&
                       pthread_create(&thread, &attributes, run, &work) == 0 && pthread_join(thread, nullptr) == 0;
  pthread_attr_destroy(&attributes);
  return started;
}

std::string rangeText(const Range& range) {
  if (range.least == range.most) return "must be " + text(range.least);
  if (std::isinf(range.most)) return "must be at least " + text(range.least);
  return "must be between " + text(range.least) + " and " + text(range.most);
}

const toml::table& asTable(const void* table) {
  return *static_cast<const toml::table*>(table);
}

}  // namespace

struct TomlTable::Document {
  toml::table root;
  std::string file;
  std::optional<FileError> fault;
  std::map<const void*, std::vector<std::string>> known;  ///< keys that were read, per table

  std::string where(const toml::node& node) const {
    const auto line = node.source().begin.line;
    return line > 0 ? file + ":" + std::to_string(line) : file;
  }

  void fail(const toml::node& node, const std::string& what) {
    if (!fault) fault = FileError{where(node), what};
  }

  /// Collects an error for each key that was not read, with its line.
  void rejectUnread(const toml::table& table, const std::string& path) {
    const std::vector<std::string>& read = known[&table];
    for (const auto& [tomlKey, node] : table) {
      const std::string_view key = tomlKey.str();
      const std::string name = path + std::string(key);
      if (std::find(read.begin(), read.end(), key) == read.end()) {
        std::string what = "unknown key '" + name + "'";
        const auto nearest = std::min_element(read.begin(), read.end(), [key](const auto& a, const auto& b) {
          return misspellings(a, key) < misspellings(b, key);
        });
        if (nearest != read.end()) what += "; the nearest known key is '" + path + *nearest + "'";
        unread.emplace_back(tomlKey.source().begin.line, FileError{where(node), what});
      } else if (const toml::table* inner = node.as_table()) {
        rejectUnread(*inner, name + ".");
      } else if (const toml::array* array = node.as_array()) {
        for (std::size_t i = 0; i < array->size(); ++i) {
          if (const toml::table* element = array->get(i)->as_table()) {
            rejectUnread(*element, name + "[" + std::to_string(i) + "].");
          }
        }
      }
    }
  }
  std::vector<std::pair<toml::source_index, FileError>> unread;
};

TomlTable::TomlTable(std::shared_ptr<Document> document, const void* node, std::string path)
    : document_(std::move(document))
    , table_(node)
    , path_(std::move(path)) {}

tl::expected<TomlTable, FileError> TomlTable::parse(std::string_view text, const std::string& file) {
  auto document = std::make_shared<Document>();
  document->file = file;
  // Any ASCII character in UTF-16 has such a byte. The parser skips the byte order mark of UTF-8.
  if (text.find('\0') != std::string_view::npos) {
    return tl::unexpected(
        FileError{file, "has bytes that are 0, as in UTF-16 (\"Unicode\" in old Notepads): save it as UTF-8"});
  }
  // The parser and the destructors of what it makes call themselves once per part of a key, and a text may have half as
  // many as bytes: some 500 bytes of stack for each, which are reserved, and used by such a text only.
#ifdef __SANITIZE_ADDRESS__
  constexpr std::size_t kUsual_bytes = 8 << 20, kPerByte = 4096;
#else
  constexpr std::size_t kUsual_bytes = 1 << 20, kPerByte = 512;
#endif
  std::optional<FileError> fault;
  const bool parsed = onStackOf(kUsual_bytes + kPerByte * text.size(), [&] {
    try {
      document->root = toml::parse(text, file);
      const auto line = lineOfTooDeep(document->root);
      if (line == 0) return;
      fault = {file + ":" + std::to_string(line),
               "has more than " + std::to_string(kDeepest) + " tables in each other"};
      document->root = {};
    } catch (const toml::parse_error& error) {
      fault = {file + ":" + std::to_string(error.source().begin.line), error.what()};
    } catch (const std::bad_alloc&) {
      fault = {file, "takes more memory to be read than there is"};
    }
  });
  if (!parsed) fault = {file, "cannot be read: there is no memory for a thread"};
  if (fault) return tl::unexpected(*std::move(fault));
  const void* root = &document->root;
  return TomlTable(std::move(document), root, "");
}

tl::expected<TomlTable, FileError> TomlTable::load(const std::string& path) {
  constexpr std::uintmax_t kLargest_bytes = 4 << 20;
  const auto unreadable = [&path](const std::string& why) {
    return tl::unexpected(FileError{path, "cannot be read: " + why, true});
  };
  const auto bytes = readWholeFile(path, kLargest_bytes);
  if (bytes) return parse({bytes->data(), bytes->size()}, path);
  if (bytes.error() == std::errc::file_too_large) return unreadable("it is larger than 4 MiB");
  if (bytes.error() != std::errc::not_supported) return unreadable(bytes.error().message());
  std::error_code ignored;
  return unreadable(std::filesystem::is_directory(path, ignored) ? "it is a directory" : "it is no regular file");
}

const void* TomlTable::find(std::string_view key) {
  std::vector<std::string>& known = document_->known[table_];
  if (std::find(known.begin(), known.end(), key) == known.end()) known.emplace_back(key);
  return asTable(table_).get(key);
}

std::optional<std::vector<double>> TomlTable::numbers(std::string_view key, const Range& range,
                                                      std::optional<std::size_t> count) {
  const auto* node = static_cast<const toml::node*>(find(key));
  if (!node) return std::nullopt;
  if (!count && node->is_number()) {
    std::vector<double> one = {std::nan("")};
    read(key, one[0], range);
    return std::isnan(one[0]) ? std::nullopt : std::optional(one);
  }
  const toml::array* array = node->as_array();
  if (!array || (count && array->size() != *count)) {
    document_->fail(*node, path_ + std::string(key) + " must be a list of " +
                               (array ? std::to_string(*count) + " " : "") + "numbers");
    return std::nullopt;
  }
  std::vector<double> values;
  for (const toml::node& element : *array) {
    if (!element.is_number()) {
      document_->fail(*node, path_ + std::string(key) + " must be a list of numbers");
      return std::nullopt;
    }
    const double number = numberIn(element);
    if (!(number >= range.least && number <= range.most && std::isfinite(number))) {
      document_->fail(*node, path_ + std::string(key) + " = " + text(number) + " " + rangeText(range));
      return std::nullopt;
    }
    values.push_back(number / range.perUnit);
  }
  return values;
}

void TomlTable::read(std::string_view key, std::span<double> values, const Range& range) {
  if (const auto read = numbers(key, range, values.size())) std::ranges::copy(*read, values.begin());
}

void TomlTable::read(std::string_view key, std::vector<double>& values, const Range& range) {
  if (auto read = numbers(key, range, std::nullopt)) values = *std::move(read);
}

void TomlTable::read(std::string_view key, double& value, const Range& range) {
  const auto* node = static_cast<const toml::node*>(find(key));
  if (!node) return;
  const std::string name = path_ + std::string(key);
  if (!node->is_number()) return document_->fail(*node, name + " must be a number");
  const double number = numberIn(*node);
  if (!(number >= range.least && number <= range.most && std::isfinite(number))) {
    return document_->fail(*node, name + " = " + text(number) + " " + rangeText(range));
  }
  value = number / range.perUnit;
}

void TomlTable::read(std::string_view key, int& value, const Range& range) {
  const auto* node = static_cast<const toml::node*>(find(key));
  if (!node) return;
  if (!node->is_integer()) return document_->fail(*node, path_ + std::string(key) + " must be a whole number");
  double number = value;
  read(key, number, range);
  value = static_cast<int>(number);
}

void TomlTable::read(std::string_view key, bool& value) {
  const auto* node = static_cast<const toml::node*>(find(key));
  if (!node) return;
  if (!node->is_boolean()) return document_->fail(*node, path_ + std::string(key) + " must be true or false");
  value = node->value<bool>().value();
}

void TomlTable::read(std::string_view key, std::string& value) {
  const auto* node = static_cast<const toml::node*>(find(key));
  if (!node) return;
  if (!node->is_string()) return document_->fail(*node, path_ + std::string(key) + " must be a text in quotes");
  value = node->value<std::string>().value();
}

void TomlTable::read(std::string_view key, std::vector<std::string>& values) {
  const auto* node = static_cast<const toml::node*>(find(key));
  if (!node) return;
  const toml::array* array = node->as_array();
  if (!array || !(array->empty() || array->is_homogeneous<std::string>())) {
    return document_->fail(*node, path_ + std::string(key) + " must be a list of texts in quotes");
  }
  values.clear();
  for (const toml::node& element : *array) values.push_back(element.value<std::string>().value());
}

std::vector<std::pair<std::string, TomlTable::Scalar>> TomlTable::entries() {
  std::vector<std::pair<toml::source_position, std::pair<std::string, Scalar>>> found;
  for (const auto& [tomlKey, node] : asTable(table_)) {
    const std::string key(tomlKey.str());
    find(key);
    Scalar value;
    if (node.is_boolean()) {
      value = node.value<bool>().value();
    } else if (node.is_integer()) {
      value = node.value<std::int64_t>().value();
    } else if (node.is_floating_point()) {
      value = node.value<double>().value();
    } else if (node.is_string()) {
      value = node.value<std::string>().value();
    } else {
      document_->fail(node, path_ + key + " must be a number, a text in quotes, true or false");
      continue;
    }
    found.emplace_back(tomlKey.source().begin, std::pair(key, std::move(value)));
  }
  // toml++ sorts keys by name; this restores the order of the file.
  std::sort(found.begin(), found.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
  std::vector<std::pair<std::string, Scalar>> result;
  for (auto& entry : found) result.push_back(std::move(entry.second));
  return result;
}

std::optional<TomlTable> TomlTable::table(std::string_view key) {
  const auto* node = static_cast<const toml::node*>(find(key));
  if (!node) return std::nullopt;
  const std::string name = path_ + std::string(key);
  if (!node->is_table()) {
    document_->fail(*node, name + " must be a table");
    return std::nullopt;
  }
  return TomlTable(document_, node->as_table(), name + ".");
}

std::vector<TomlTable> TomlTable::tables(std::string_view key) {
  const auto* node = static_cast<const toml::node*>(find(key));
  std::vector<TomlTable> found;
  if (!node) return found;
  const std::string name = path_ + std::string(key);
  if (const toml::array* array = node->as_array();
      array && (array->empty() || array->is_homogeneous(toml::node_type::table))) {
    for (std::size_t i = 0; i < array->size(); ++i) {
      found.push_back(TomlTable(document_, array->get(i)->as_table(), name + "[" + std::to_string(i) + "]."));
    }
  } else {
    document_->fail(*node, name + " must be a list of tables");
  }
  return found;
}

bool TomlTable::has(std::string_view key) const {
  return asTable(table_).contains(key);
}

void TomlTable::fail(std::string_view key, const std::string& what) {
  const toml::node* node = asTable(table_).get(key);
  document_->fail(node ? *node : asTable(table_), path_ + std::string(key) + " " + what);
}

tl::expected<void, FileError> TomlTable::finish(bool isStrict) {
  if (!document_->fault && isStrict) {
    document_->unread.clear();
    document_->rejectUnread(document_->root, "");
    const auto first = std::min_element(document_->unread.begin(), document_->unread.end(),
                                        [](const auto& a, const auto& b) { return a.first < b.first; });
    if (first != document_->unread.end()) document_->fault = first->second;
  }
  if (document_->fault) return tl::unexpected(*document_->fault);
  return {};
}

std::string quoted(const std::string& text) {
  std::string result = "\"";
  for (const char letter : text) {
    if (letter == '"' || letter == '\\') {
      result += '\\';
      result += letter;
    } else if (static_cast<unsigned char>(letter) < 0x20 || letter == 0x7f) {
      std::array<char, 8> code{};
      std::snprintf(code.data(), code.size(), "\\u%04X", static_cast<unsigned>(letter));
      result += code.data();
    } else {
      result += letter;
    }
  }
  return result + '"';
}

}  // namespace tractiond
