// Writes numbers of the fields of a recording as CSV.
#pragma once

#include "client/cli/skipped.h"
#include "client/files/failure.h"
#include "client/files/recorded_sources.h"
#include "recording/reader.h"
#include "traction/subscriber.h"

#include <sysexits.h>

#include <array>
#include <cerrno>
#include <charconv>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <set>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>

namespace traction::client {

/// Builds a line of comma-separated values. The functions add() append values and return this line.
class CsvLine {
 public:
  /// Appends a text as it is: a comma or a quote in it is not escaped. The first one must not be empty.
  CsvLine& add(std::string_view word) {
    if (!text_.empty()) text_ += ',';
    text_ += word;
    return *this;
  }
  /// Appends a number with the fewest digits that give it again, in any locale.
  template <typename Number>
  requires std::is_arithmetic_v<Number> CsvLine& add(Number number) {
    std::array<char, 32> digits{};
    const char* const end = std::to_chars(digits.data(), digits.data() + digits.size(), number).ptr;
    return add(std::string_view(digits.data(), static_cast<std::size_t>(end - digits.data())));
  }
  /// Appends each component as a value of its own.
  template <std::size_t kSize>
  CsvLine& add(const std::array<double, kSize>& vector) {
    for (const double each : vector) add(each);
    return *this;
  }
  /// Returns the line with its line end, and leaves an empty one.
  std::string take() { return std::move(text_) + "\n"; }

 private:
  std::string text_;
};

/// Writes a CSV file from the fields of a recording. It replaces `to`, and is deleted if finish() was not called or has
/// failed before the file was complete. Thread-bound.
/// \throws Failure as exportFields()
class CsvFile {
 public:
  /// Opens the recording `from`, and creates `to` with the first line.
  /// \param sensor whose fields are written; empty: those of all
  /// \param columns first line, with its line end
  CsvFile(const std::string& from, const std::string& to, const std::string& sensor, std::string_view columns)
      : from_(from)
      , to_(to)
      , sensor_(sensor)
      , reader_(orThrow(recording::Reader::open(from)))
      , sources_(sourcesOf(reader_))
      , file_(to) {
    if (!file_) throw Failure(EX_CANTCREAT, to_ + " cannot be created: " + std::strerror(errno));
    file_ << columns;
  }

  ~CsvFile() {
    std::error_code unknown;
    if (!isDone_) std::filesystem::remove(to_, unknown);
  }
  CsvFile(const CsvFile&) = delete;
  CsvFile& operator=(const CsvFile&) = delete;

  /// Reads the recording and calls `put(record, field)` for each field of the sensor that can be decoded.
  template <typename Put>
  void forEachField(Put&& put) {
    extent_ = orThrow(reader_.read(
        [&](const recording::Channel& channel, const recording::Schema*, const recording::Message& record) {
          if (!channel.topic.ends_with("/field/")) return;
          try {
            const auto message = decode(Raw{channel.topic, record.data});
            if (sources_.isSecond(message.value())) return;
            const auto& field = std::get<Field>(message.value());
            sensors_.insert(field.header.sensor);
            if (!sensor_.empty() && field.header.sensor != sensor_) return;
            put(record, field);
            ++fields_;
          } catch (const Error& error) {
            skipped_.add(error, record.sequence);
          }
        }));
  }
  /// Writes lines, with their line ends.
  void write(const std::string& lines) { file_ << lines; }
  const std::set<std::string>& sensors() const { return sensors_; }  ///< Returns the sensors that had fields.

  /// Closes the file.
  /// \throws Failure if there are no fields or the file cannot be written; also if fields were left out, as damaged or
  /// of a second source of the name, but then the file is complete and remains
  void finish() {
    const std::string trouble = troubleOf(extent_, skipped_, sources_);
    if (fields_ == 0 && !sensors_.empty()) {
      throw Failure(EX_DATAERR, from_ + " is of another sensor: it has fields of " + names() + ", not of " + sensor_);
    }
    if (fields_ == 0)
      throw Failure(skipped_.exitCode(), from_ + " has no fields" + (trouble.empty() ? "" : "; " + trouble));
    file_.close();
    if (!file_) throw Failure(EX_IOERR, to_ + " cannot be written");
    isDone_ = true;
    if (trouble.empty()) return;
    throw Failure(skipped_.exitCode(), from_ + ": " + trouble + "; " + to_ + " has the " + std::to_string(fields_) +
                                           " fields that could be read");
  }
  /// Returns the sensors' names: "left, right".
  std::string names() const {
    std::string text;
    for (const std::string& name : sensors_) text += (text.empty() ? "" : ", ") + name;
    return text;
  }

 private:
  std::string from_, to_, sensor_;
  recording::Reader reader_;
  Sources sources_;
  std::ofstream file_;
  recording::Extent extent_;
  Skipped skipped_;
  std::set<std::string> sensors_;
  std::uint64_t fields_ = 0;
  bool isDone_ = false;
};

}  // namespace traction::client
