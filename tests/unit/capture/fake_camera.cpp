#include "tests/unit/capture/fake_camera.h"

#include <arv.h>

#include <stdexcept>

namespace tractiond::test {

FakeCamera::FakeCamera(const Options& options)
    : camera_(arv_gv_fake_camera_new(options.address.c_str(), options.serial.c_str())) {
  if (!arv_gv_fake_camera_is_running(camera_)) throw std::runtime_error("the fake camera does not run");
  write(ARV_FAKE_CAMERA_REGISTER_WIDTH, 64);
  write(ARV_FAKE_CAMERA_REGISTER_HEIGHT, 48);
  write(ARV_FAKE_CAMERA_REGISTER_PIXEL_FORMAT, ARV_PIXEL_FORMAT_RGB_8_PACKED);
  write(ARV_FAKE_CAMERA_REGISTER_ACQUISITION_FRAME_PERIOD_US, static_cast<std::uint32_t>(1e6 / options.rate_Hz));
}

FakeCamera::~FakeCamera() {
  g_object_unref(camera_);
}

void FakeCamera::write(std::uint32_t address, std::uint32_t value) {
  arv_fake_camera_write_register(arv_gv_fake_camera_get_fake_camera(camera_), address, value);
}

std::uint32_t FakeCamera::read(std::uint32_t address) const {
  std::uint32_t value = 0;
  arv_fake_camera_read_register(arv_gv_fake_camera_get_fake_camera(camera_), address, &value);
  return value;
}

}  // namespace tractiond::test
