#include "client/cli/csv_file.h"
#include "client/cli/recordings.h"
#include "client/show/reflection.h"
#include "client/touch/follower.h"
#include "proto/traction/v1/endpoints.h"
#include "traction/v1/contacts.pb.h"

#include <sysexits.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <string>
#include <string_view>

namespace traction::client {
namespace {

constexpr std::string_view kColumns =
    "log_time_ns,capture_time_ns,frame_number,sensor,id,phase,doubted,begun_ns,seen_ns,x_m,y_m,z_m,deviation_x_m,"
    "deviation_y_m,force_x_N,force_y_N,force_z_N,force_deviation_x_N,force_deviation_y_N,force_deviation_z_N,"
    "moment_x_Nm,moment_y_Nm,moment_z_Nm,moment_deviation_x_Nm,moment_deviation_y_Nm,moment_deviation_z_Nm,radius_m,"
    "half_axis_long_m,half_axis_short_m,orientation_rad,orientation_deviation_rad,velocity_x_m_s,velocity_y_m_s,"
    "angular_velocity_rad_s,angular_velocity_deviation_rad_s,slip,stick_ratio,stick_ratio_low,stick_ratio_high,"
    "friction,friction_low,friction_high,margin_N,holding_force_N,slip_model,end_cause\n";

std::array<double, 2> arrayOf(const v1::Vector2& vector) {
  return {vector.x(), vector.y()};
}

std::array<double, 3> arrayOf(const v1::Vector3& vector) {
  return {vector.x(), vector.y(), vector.z()};
}

std::array<double, 3> arrayOf(const v1::Interval& of) {
  return {of.estimate(), of.low(), of.high()};
}

/// Returns the deviations that noise causes, as those of the force.
std::array<double, 3> deviationsOf(const v1::Covariance& covariance) {
  const auto deviation = [&](int at) { return std::sqrt(std::max(0.0, covariance.noise(at))); };
  return {deviation(0), deviation(4), deviation(8)};
}

std::string lineOf(const recording::Message& record, const v1::Header& header, const v1::TrackedContact& contact) {
  CsvLine line;
  line.add(record.logTime_ns).add(record.publishTime_ns).add(header.frame_number()).add(header.sensor());
  line.add(contact.id()).add(wordOf("ContactPhase", contact.phase())).add(int{contact.doubted()});
  line.add(contact.begun_ns()).add(contact.seen_ns()).add(arrayOf(contact.position_m())).add(contact.position_z_m());
  line.add(arrayOf(contact.position_deviation_m())).add(arrayOf(contact.force_n()));
  line.add(arrayOf(contact.force_deviation_n())).add(arrayOf(contact.moment_nm()));
  line.add(deviationsOf(contact.moment_covariance_n2m2())).add(contact.radius_m()).add(arrayOf(contact.half_axes_m()));
  line.add(contact.orientation_rad()).add(contact.orientation_deviation_rad()).add(arrayOf(contact.velocity_m_s()));
  line.add(contact.angular_velocity_rad_s()).add(contact.angular_velocity_deviation_rad_s());
  if (contact.has_slip()) {
    const v1::Slip& slip = contact.slip();
    line.add(wordOf("SlipState", slip.state())).add(arrayOf(slip.stick_ratio()));
    line.add(arrayOf(slip.friction())).add(slip.margin_n()).add(slip.holding_force_n());
    line.add(wordOf("SlipModel", slip.model()));
  } else {
    line.add(",,,,,,,,,");  // not known
  }
  return line.add(wordOf("EndCause", contact.end_cause())).take();
}

}  // namespace

void exportContacts(const std::string& from, const std::string& to, const std::string& sensor) {
  if (!to.ends_with(".csv")) throw Failure(EX_USAGE, "'" + to + "' does not end with .csv, as contacts do");
  CsvFile file(from, to, sensor, kColumns);
  std::map<std::string, contacts::Follower> followers;  // by sensor
  recording::Message last;
  const auto put = [&](const v1::Contacts& contacts, const recording::Message& record) {
    for (const v1::TrackedContact& each : contacts.contacts()) file.write(lineOf(record, contacts.header(), each));
  };
  file.forEachField([&](const recording::Message& record, const Field& field) {
    if (!isValidName(field.header.sensor)) return;
    auto& follower = followers.try_emplace(field.header.sensor, contacts::Follower::Options{}).first->second;
    put(follower.take(field, record.data), record);
    last = record;
  });
  for (auto& [name, follower] : followers) {
    if (follower.hasContacts()) put(follower.endAll(), last);
  }
  file.finish();
}

}  // namespace traction::client
