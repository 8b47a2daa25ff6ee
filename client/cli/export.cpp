#include "client/cli/csv_line.h"
#include "client/cli/draft.h"
#include "client/cli/npz.h"
#include "client/cli/recordings.h"
#include "client/cli/skipped.h"
#include "client/files/file_error.h"
#include "client/files/message_header.h"
#include "recording/reader.h"

#include <sysexits.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <system_error>
#include <type_traits>
#include <utility>
#include <vector>

namespace traction::client {

namespace {

/// Reads the fields of a recording.
class Source {
 public:
  explicit Source(const std::string& file)
      : reader_(orThrow(recording::Reader::open(file))) {}

  using Use = std::function<void(const recording::Message&, const Message&)>;

  /// Calls `use` for each message that can be decoded, and counts the others.
  recording::Extent each(const Use& use, Skipped& skipped) const {
    return orThrow(reader_.read(
        [&](const recording::Channel& channel, const recording::Schema*, const recording::Message& record) {
          if (!channel.topic.ends_with("/field/") && !channel.topic.ends_with("/description/")) return;
          std::optional<Message> message;
          try {
            message = decode(Raw{channel.topic, record.data});
          } catch (const Error& error) {
            skipped.add(error, record.sequence);
          }
          if (message) use(record, *message);
        }));
  }

 private:
  recording::Reader reader_;
};

/// Survey of a recording before it is exported.
struct Survey {
  std::string sensor;
  std::map<std::size_t, std::uint64_t> counts;  ///< number of nodes -> number of fields that have as many
  std::optional<Description> description;       ///< the newest
  recording::Extent extent;
  Skipped skipped;

  std::uint64_t fields() const {
    std::uint64_t sum = 0;
    for (const auto& [nodes, fields] : counts) sum += fields;
    return sum;
  }
  /// Returns the number of nodes that most fields have, of those that have any.
  std::size_t nodes() const {
    std::pair<std::uint64_t, std::size_t> most;
    for (const auto& [nodes, fields] : counts) {
      if (nodes != 0) most = std::max(most, {fields, nodes});
    }
    return most.second;
  }
  /// Returns what keeps the export from being all of the recording, as text; empty: nothing.
  std::string trouble() const { return troubleOf(extent, skipped); }
};

Survey surveyOf(const Source& source, const std::string& file, const std::string& wanted) {
  std::map<std::string, Survey> sensors;
  Survey all;
  all.extent = source.each(
      [&](const recording::Message&, const Message& message) {
        Survey& survey = sensors[headerOf(message).sensor];
        if (const auto* field = std::get_if<Field>(&message)) {
          ++survey.counts[field->force_N.size()];
        } else if (const auto* description = std::get_if<Description>(&message)) {
          survey.description = *description;
        }
      },
      all.skipped);
  std::erase_if(sensors, [](const auto& one) { return one.second.counts.empty(); });
  if (sensors.empty()) {
    const std::string trouble = all.trouble();
    throw FileError(all.skipped.exitCode(), file + " has no fields" + (trouble.empty() ? "" : "; " + trouble));
  }
  std::string names;
  for (const auto& [name, survey] : sensors) names += (names.empty() ? "" : ", ") + name;
  if (wanted.empty() && sensors.size() > 1) {
    throw FileError(EX_USAGE, file + " has fields of " + names + ": which? --sensor NAME");
  }
  const auto found = wanted.empty() ? sensors.begin() : sensors.find(wanted);
  if (found == sensors.end()) {
    throw FileError(EX_DATAERR, file + " is of another sensor: it has fields of " + names + ", not of " + wanted);
  }
  Survey survey = found->second;
  survey.sensor = found->first;
  survey.extent = all.extent;
  survey.skipped = all.skipped;
  return survey;
}

/// Returns the standard deviation of one component [N], from a covariance [N^2].
double deviationOf(const Covariance& covariance, std::size_t axis) {
  return std::sqrt(std::max(0.0, covariance.noise.at(4 * axis) + covariance.systematic.at(4 * axis)));
}

std::array<double, 3> deviationsOf(const Covariance& covariance) {
  return {deviationOf(covariance, 0), deviationOf(covariance, 1), deviationOf(covariance, 2)};
}

constexpr const char* kColumns =
    "log_time_ns,capture_time_ns,sequence,frame_number,camera_frame_id,valid,method,flags,"
    "force_x_N,force_y_N,force_z_N,force_deviation_x_N,force_deviation_y_N,force_deviation_z_N,"
    "moment_x_Nm,moment_y_Nm,moment_z_Nm,moment_deviation_x_Nm,moment_deviation_y_Nm,moment_deviation_z_Nm,"
    "pressure_x_m,pressure_y_m,pressure_valid,contacts,residual_px,valid_markers\n";

std::string lineOf(const recording::Message& record, const Field& field) {
  CsvLine line;
  line.add(record.logTime_ns).add(record.publishTime_ns).add(field.header.sequence).add(field.header.frameNumber);
  line.add(field.header.cameraFrameId).add(static_cast<int>(field.valid)).add(static_cast<int>(field.method));
  line.add(field.header.flags).add(field.resultant_N).add(deviationsOf(field.resultantCovariance_N2));
  line.add(field.moment_Nm).add(deviationsOf(field.momentCovariance_N2m2));
  line.add(field.centreOfPressure_m[0]).add(field.centreOfPressure_m[1]);
  line.add(static_cast<int>(field.centreOfPressureValid)).add(field.contacts.size());
  line.add(field.residual_px).add(field.validMarkers);
  return line.take();
}

void writeCsv(const Source& source, const Survey& survey, const std::string& path) {
  const std::unique_ptr<std::FILE, int (*)(std::FILE*)> file(std::fopen(path.c_str(), "w"), &std::fclose);
  if (!file) throw FileError(EX_IOERR, path + " cannot be written: " + std::strerror(errno));
  const auto put = [&](const std::string& text) {
    if (std::fwrite(text.data(), 1, text.size(), file.get()) == text.size()) return;
    throw FileError(EX_IOERR, path + " cannot be written: " + std::strerror(errno));
  };
  put(kColumns);
  Skipped again;
  source.each(
      [&](const recording::Message& record, const Message& message) {
        const auto* field = std::get_if<Field>(&message);
        if (field != nullptr && field->header.sensor == survey.sensor) put(lineOf(record, *field));
      },
      again);
  if (std::fflush(file.get()) != 0) {
    throw FileError(EX_IOERR, path + " cannot be written: " + std::strerror(errno));
  }
}

/// An array with a row for each field.
struct Column {
  NpzWriter::Array array;
  std::function<std::string(const recording::Message&, const Field&)> row;  ///< returns the row's bytes; empty: zeros
};

template <typename Number>
std::string bytesOf(const Number* numbers, std::size_t count) {
  return {reinterpret_cast<const char*>(numbers), count * sizeof(Number)};
}

template <typename Number>
constexpr const char* kType = nullptr;
template <>
constexpr const char* kType<double> = "<f8";
template <>
constexpr const char* kType<std::int64_t> = "<i8";
template <>
constexpr const char* kType<std::uint64_t> = "<u8";
template <>
constexpr const char* kType<std::uint32_t> = "<u4";
template <>
constexpr const char* kType<std::uint8_t> = "|u1";
template <>
constexpr const char* kType<bool> = "|b1";

/// Makes an array of one number per field.
template <typename Get>
Column scalar(const std::string& name, Get get) {
  using Number = std::invoke_result_t<Get, const recording::Message&, const Field&>;
  return {{name, kType<Number>, 0, {}, sizeof(Number)}, [get](const recording::Message& record, const Field& field) {
            const Number number = get(record, field);
            return bytesOf(&number, 1);
          }};
}

/// Makes an array of doubles.
template <typename Get>
Column block(const std::string& name, std::vector<std::size_t> shape, Get get) {
  return {{name, "<f8", 0, std::move(shape), 8}, [get](const recording::Message&, const Field& field) {
            const auto numbers = get(field);
            return bytesOf(numbers.data(), numbers.size());
          }};
}

Matrix3 sumOf(const Covariance& covariance) {
  Matrix3 sum = covariance.noise;
  for (std::size_t i = 0; i < sum.size(); ++i) sum.at(i) += covariance.systematic.at(i);
  return sum;
}

std::vector<Column> columnsOf(std::size_t nodes) {
  using Record = recording::Message;
  std::vector<Column> columns = {
      scalar("log_time_ns", [](const Record& record, const Field&) { return record.logTime_ns; }),
      scalar("capture_time_ns", [](const Record& record, const Field&) { return record.publishTime_ns; }),
      scalar("captured_ns", [](const Record&, const Field& field) { return field.header.captured_ns; }),
      scalar("captured_error_ns", [](const Record&, const Field& field) { return field.header.capturedError_ns; }),
      scalar("received_ns", [](const Record&, const Field& field) { return field.header.received_ns; }),
      scalar("sequence", [](const Record&, const Field& field) { return field.header.sequence; }),
      scalar("frame_number", [](const Record&, const Field& field) { return field.header.frameNumber; }),
      scalar("camera_frame_id", [](const Record&, const Field& field) { return field.header.cameraFrameId; }),
      scalar("flags", [](const Record&, const Field& field) { return field.header.flags; }),
      scalar("valid", [](const Record&, const Field& field) { return field.valid; }),
      scalar("method", [](const Record&, const Field& field) { return static_cast<std::uint8_t>(field.method); }),
      scalar("residual_px", [](const Record&, const Field& field) { return field.residual_px; }),
      scalar("valid_markers", [](const Record&, const Field& field) { return field.validMarkers; }),
      scalar("centre_of_pressure_valid", [](const Record&, const Field& field) { return field.centreOfPressureValid; }),
      block("centre_of_pressure_m", {2}, [](const Field& field) { return field.centreOfPressure_m; }),
      block("resultant_N", {3}, [](const Field& field) { return field.resultant_N; }),
      block("moment_Nm", {3}, [](const Field& field) { return field.moment_Nm; }),
      block("resultant_covariance_N2", {3, 3}, [](const Field& field) { return sumOf(field.resultantCovariance_N2); }),
      block("moment_covariance_N2m2", {3, 3}, [](const Field& field) { return sumOf(field.momentCovariance_N2m2); }),
  };
  columns.push_back({{"force_N", "<f4", 0, {nodes, 3}, 4}, [](const Record&, const Field& field) {
                       return bytesOf(field.force_N.data(), field.force_N.size());
                     }});
  columns.push_back({{"node_deviation_N", "<f4", 0, {nodes, 3}, 4}, [](const Record&, const Field& field) {
                       return bytesOf(field.nodeDeviation_N.data(), field.nodeDeviation_N.size());
                     }});
  columns.push_back({{"node_valid", "|b1", 0, {nodes}, 1}, [](const Record&, const Field& field) {
                       std::vector<std::uint8_t> valid = field.nodeValid;
                       for (std::uint8_t& one : valid) one = one != 0 ? 1 : 0;
                       return bytesOf(valid.data(), valid.size());
                     }});
  return columns;
}

/// Returns the nodes' positions, gel frame [m]; empty: no description was recorded.
std::vector<std::array<float, 3>> positionsOf(const Survey& survey) {
  if (!survey.description) return {};
  if (survey.description->body) return survey.description->body->nodePositions_m;
  const Grid& grid = survey.description->nodes;
  std::vector<std::array<float, 3>> positions;
  if (std::uint64_t{grid.rows} * grid.columns != survey.nodes()) return positions;
  for (std::uint32_t row = 0; row < grid.rows; ++row) {
    for (std::uint32_t column = 0; column < grid.columns; ++column) {
      const Vector2 at = grid.position_m(column, row);
      positions.push_back({static_cast<float>(at[0]), static_cast<float>(at[1]), 0.0F});
    }
  }
  return positions;
}

/// Adds the fields that no array can hold to `survey.skipped`: they have another number of nodes than most.
void writeNpz(const Source& source, Survey& survey, const std::string& path) try {
  const std::size_t nodes = survey.nodes();
  std::erase_if(survey.counts, [nodes](const auto& one) { return one.first != 0 && one.first != nodes; });
  std::vector<Column> columns = columnsOf(nodes);
  std::vector<NpzWriter::Array> arrays;
  for (Column& column : columns) {
    column.array.rows = survey.fields();
    arrays.push_back(column.array);
  }
  const auto positions = positionsOf(survey);
  if (positions.size() == nodes) arrays.push_back({"node_position_m", "<f4", positions.size(), {3}, 4});
  NpzWriter writer(path, arrays);
  Skipped again;
  source.each(
      [&](const recording::Message& record, const Message& message) {
        const auto* field = std::get_if<Field>(&message);
        if (field == nullptr || field->header.sensor != survey.sensor) return;
        if (!survey.counts.contains(field->force_N.size())) {
          return survey.skipped.add("it has " + std::to_string(field->force_N.size()) + " nodes and most have " +
                                        std::to_string(nodes) + ", for which the arrays are; .csv takes it",
                                    record.sequence);
        }
        for (std::size_t i = 0; i < columns.size(); ++i) {
          std::string row = columns[i].row(record, *field);
          row.resize(arrays[i].rowBytes());  // of a field without nodes: zeros
          writer.add(i, row);
        }
      },
      again);
  if (arrays.size() > columns.size()) writer.add(columns.size(), bytesOf(positions.data(), positions.size()));
  writer.finish();
} catch (const NpzError& error) {
  throw FileError(EX_IOERR, path + " cannot be written: " + error.what());
}

}  // namespace

void exportFields(const std::string& from, const std::string& to, const std::string& sensor) {
  const bool isCsv = to.ends_with(".csv");
  if (to.ends_with(".mcap")) return illustrate(from, to, sensor);
  if (!isCsv && !to.ends_with(".npz"))
    throw FileError(EX_USAGE, "'" + to + "' ends neither with .csv nor with .npz nor with .mcap");
  const Source source(from);
  Survey survey = surveyOf(source, from, sensor);
  Draft draft(to);
  if (isCsv) {
    writeCsv(source, survey, draft.part());
  } else {
    writeNpz(source, survey, draft.part());
  }
  draft.finish();
  const std::string trouble = survey.trouble();
  if (trouble.empty()) return;
  throw FileError(survey.skipped.exitCode(), from + ": " + trouble + "; " + to + " has the " +
                                                 std::to_string(survey.fields()) + " fields that could be read");
}

}  // namespace traction::client
