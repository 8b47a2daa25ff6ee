#include "client/cli/csv_file.h"
#include "client/cli/recordings.h"
#include "client/show/scene.h"

#include <sysexits.h>

#include <string>

namespace traction::client {

namespace {

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

}  // namespace

void exportFields(const std::string& from, const std::string& to, const std::string& sensor) {
  if (to.ends_with(".mcap")) return illustrate(from, to, sensor);
  if (!to.ends_with(".csv")) throw Failure(EX_USAGE, "'" + to + "' ends neither with .csv nor with .mcap");
  CsvFile file(from, to, sensor, kColumns);
  file.forEachField([&](const recording::Message& record, const Field& field) { file.write(lineOf(record, field)); });
  if (sensor.empty() && file.sensors().size() > 1)
    throw Failure(EX_USAGE, from + " has fields of " + file.names() + ": which? --sensor NAME");
  file.finish();
}

}  // namespace traction::client
