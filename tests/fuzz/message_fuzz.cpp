#include "client/src/decode.h"
#include "client/src/decode_control.h"
#include "client/src/messages.h"
#include "tests/fuzz/target.h"
#include "traction/v1/contacts.pb.h"
#include "traction/v1/control.pb.h"
#include "traction/v1/description.pb.h"
#include "traction/v1/field.pb.h"
#include "traction/v1/grasp.pb.h"
#include "traction/v1/markers.pb.h"
#include "traction/v1/preview.pb.h"
#include "traction/v1/status.pb.h"

#include <google/protobuf/stubs/logging.h>

namespace fuzz {

std::vector<std::string> seeds() {
  google::protobuf::SetLogHandler(nullptr);  // a line for each text that is none
  namespace pb = traction::v1;
  std::vector<std::string> all;
  const auto add = [&all](auto message) {
    message.mutable_header()->set_frame_number(1);
    all.push_back(message.SerializeAsString());
  };
  pb::Status status;
  status.mutable_ledger()->set_received(7);
  pb::Preview preview;
  preview.set_width(2);
  preview.set_height(1);
  preview.set_format(pb::PREVIEW_FORMAT_MONO8);
  preview.set_pixels("ab");
  pb::Contacts contacts;
  contacts.add_contacts()->mutable_slip()->set_state(pb::SLIP_STATE_STICKING);
  pb::Grasp grasp;
  grasp.add_fingers()->set_state(pb::FINGER_STATE_MATCHED);
  add(pb::Field());
  add(pb::Markers());
  add(status);
  add(pb::Description());
  add(preview);
  add(contacts);
  add(grasp);
  pb::Reply reply;
  reply.set_version(1);
  *reply.mutable_status() = status;
  all.push_back(reply.SerializeAsString());
  return all;
}

bool feed(std::string_view bytes) {
  bool taken = false;
  const auto attempt = [&](auto decode) {
    try {
      static_cast<void>(decode(bytes));
      taken = true;
    } catch (const traction::Error&) {
    }
  };
  for (unsigned topic = traction::kField; topic <= traction::kGrasp; topic *= 2)
    attempt([topic](std::string_view of) { return traction::decode(topic, of); });
  using Reply = traction::v1::Reply;
  using traction::replyOf;
  attempt([](std::string_view of) { return traction::statusOf(replyOf(of, Reply::kStatus).status()); });
  attempt([](std::string_view of) { return traction::descriptionOf(replyOf(of, Reply::kDescription).description()); });
  attempt([](std::string_view of) { return traction::snapshotOf(replyOf(of, Reply::kSnapshot).snapshot()); });
  attempt([](std::string_view of) { return traction::resultOf(replyOf(of, Reply::kZero).zero()); });
  attempt([](std::string_view of) { return traction::reportOf(replyOf(of, Reply::kCalibrate).calibrate()); });
  attempt([](std::string_view of) { return traction::reportOf(replyOf(of, Reply::kCamera).camera()); });
  return taken;
}

}  // namespace fuzz
