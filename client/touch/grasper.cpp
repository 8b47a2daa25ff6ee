#include "client/touch/grasper.h"

#include "proto/traction/v1/vectors.h"

#include <algorithm>
#include <limits>

namespace traction::contacts {
namespace {

using Block = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;

std::vector<touch::Pose> posesOf(const HandFile& hand) {
  std::vector<touch::Pose> poses;
  for (const HandFile::Finger& finger : hand.fingers) poses.push_back(finger.pose);
  return poses;
}

/// Returns the whole of three parts: of the force, of the moment, and of the force (row) with the moment.
touch::Wrench::Matrix6 whole(const Matrix3& force, const Matrix3& moment, const Matrix3& both) {
  const Eigen::Matrix3d cross = Eigen::Map<const Block>(both.data());
  touch::Wrench::Matrix6 matrix;
  matrix << Eigen::Map<const Block>(force.data()), cross, cross.transpose(), Eigen::Map<const Block>(moment.data());
  return matrix;
}

touch::FingerFrame observed(const Field& field) {
  const Covariance &force = field.resultantCovariance_N2, &moment = field.momentCovariance_N2m2,
                   &both = field.resultantMomentCovariance_N2m;
  touch::FingerFrame frame{.header = field.header, .valid = field.valid, .wrench = {}};
  frame.wrench.value << Eigen::Vector3d(field.resultant_N.data()), Eigen::Vector3d(field.moment_Nm.data());
  frame.wrench.noise = whole(force.noise, moment.noise, both.noise);
  frame.wrench.systematic = whole(force.systematic, moment.systematic, both.systematic);
  return frame;
}

void encode(const touch::Wrench& from, Eigen::Index row, Eigen::Index column, v1::Covariance& to) {
  const auto put = [&](const touch::Wrench::Matrix6& matrix, google::protobuf::RepeatedField<double>& numbers) {
    const Block block = matrix.block<3, 3>(row, column);
    numbers.Assign(block.data(), block.data() + block.size());
  };
  put(from.noise, *to.mutable_noise());
  put(from.systematic, *to.mutable_systematic());
}

/// Of a Grasp, or a Finger.
void encode(const touch::Wrench& from, auto& to) {
  setVector(from.value.head<3>(), *to.mutable_force_n());
  setVector(from.value.tail<3>(), *to.mutable_moment_nm());
  encode(from, 0, 0, *to.mutable_force_covariance_n2());
  encode(from, 3, 3, *to.mutable_moment_covariance_n2m2());
  encode(from, 0, 3, *to.mutable_force_moment_covariance_n2m());
}

}  // namespace

Grasper::Grasper(const HandFile& hand, const Options& options)
    : options_(options)
    , hand_(posesOf(hand)) {
  message_.mutable_header()->set_sensor(hand.name);
  message_.mutable_header()->set_boot(options.boot.data(), options.boot.size());
  for (const HandFile::Finger& each : hand.fingers) {
    v1::Finger& finger = *message_.add_fingers();
    finger.set_instance(each.instance);
    finger.set_link(each.link);
  }
}

const v1::Grasp* Grasper::take(std::size_t finger, const Field& field) {
  const touch::Grasp* grasp = hand_.take(finger, observed(field), field.header.arrived_ns);
  return grasp == nullptr ? nullptr : &fill(*grasp);
}

const v1::Grasp& Grasper::wait() {
  return fill(hand_.wait(options_.monotonicClock()));
}

void Grasper::fillHeader(const touch::Grasp& grasp) {
  v1::Header& header = *message_.mutable_header();
  std::uint32_t flags = 0;
  std::int64_t received_ns = 0, real_ns = 0;
  CaptureBound bound = CaptureBound::kBoth;
  const bool isSet = grasp.latest_ns != 0;
  for (const touch::Grasp::Finger& each : grasp.fingers) {
    flags |= each.frame.header.flags;
    received_ns = std::max(received_ns, each.frame.header.received_ns);
    real_ns = std::max(real_ns, each.frame.header.receivedReal_ns);
    if (each.frame.header.capturedBound != CaptureBound::kBoth) bound = each.frame.header.capturedBound;
  }
  header.set_flags(isSet ? flags : 0);
  header.set_received_ns(isSet ? received_ns : 0);
  header.set_received_real_ns(isSet ? real_ns : 0);
  header.set_captured_ns(grasp.earliest_ns + (grasp.latest_ns - grasp.earliest_ns) / 2);
  header.set_captured_error_ns((grasp.latest_ns - grasp.earliest_ns + 1) / 2);
  header.set_captured_bound(isSet ? static_cast<v1::CaptureBound>(bound) : v1::CAPTURE_BOUND_NONE);
  header.set_sequence(++sequence_);
  header.set_sent_ns(options_.monotonicClock());
  message_.set_timestamp(1e-9 * static_cast<double>(isSet ? real_ns : options_.realClock()));
}

const v1::Grasp& Grasper::fill(const touch::Grasp& grasp) {
  fillHeader(grasp);
  message_.set_valid(grasp.valid);
  encode(grasp.wrench, message_);
  for (std::size_t i = 0; i < grasp.fingers.size(); ++i) {
    const touch::Grasp::Finger& from = grasp.fingers[i];
    v1::Finger& to = *message_.mutable_fingers(static_cast<int>(i));
    to.set_state(static_cast<v1::FingerState>(from.state));
    to.set_sensor(from.frame.header.sensor);
    to.set_frame_number(from.frame.header.frameNumber);
    to.set_captured_ns(from.frame.header.captured_ns);
    to.set_captured_error_ns(from.frame.header.capturedError_ns);
    to.set_captured_bound(static_cast<v1::CaptureBound>(from.frame.header.capturedBound));
    encode(from.frame.wrench, to);
  }
  return message_;
}

}  // namespace traction::contacts
