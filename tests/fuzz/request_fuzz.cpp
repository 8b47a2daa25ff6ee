#include "daemon/publish/wire_control.h"
#include "tests/fuzz/target.h"
#include "traction/v1/control.pb.h"

namespace fuzz {

std::vector<std::string> seeds() {
  traction::v1::Request zero, weight, camera, status;
  zero.mutable_zero()->set_anyway(true);
  zero.set_on_behalf_of("ada at 127.0.0.1");
  weight.mutable_calibrate()->mutable_weight()->set_weight_n(1.0);
  camera.mutable_camera()->mutable_write()->set_name("BalanceRatio[Red]");
  camera.mutable_camera()->mutable_write()->set_value("1.5");
  status.mutable_status();
  std::vector<std::string> all;
  for (auto* one : {&zero, &weight, &camera, &status}) {
    one->set_version(1);
    all.push_back(one->SerializeAsString());
  }
  return all;
}

bool feed(std::string_view bytes) {
  return tractiond::publish::decodeRequest(bytes).has_value();
}

}  // namespace fuzz
