#include "tests/unit/capture/fake_camera.h"

#include "base/aravis_versions.h"

#include <arv.h>
#include <unistd.h>

#include <cstring>
#include <stdexcept>

namespace tractiond::test {

struct FakeCamera::Painter {
  std::uint64_t count = 0;

  static void paint(ArvBuffer* buffer, void* self, std::uint32_t, std::uint32_t, ArvPixelFormat) {
    std::size_t unused = 0;
    // The size is not told here; 8 bytes fit into every picture.
    auto* data = const_cast<void*>(arv_buffer_get_data(buffer, &unused));
    const std::uint64_t count = ++static_cast<Painter*>(self)->count;
    std::memcpy(data, &count, sizeof count);
  }
};

FakeCamera::FakeCamera(const Options& options)
    : painter_(std::make_unique<Painter>())
    , camera_(arv_gv_fake_camera_new(options.address.c_str(), options.serial.c_str())) {
  if (!arv_gv_fake_camera_is_running(camera_)) throw std::runtime_error("the fake camera does not run");
  write(ARV_FAKE_CAMERA_REGISTER_WIDTH, static_cast<std::uint32_t>(options.width));
  write(ARV_FAKE_CAMERA_REGISTER_HEIGHT, static_cast<std::uint32_t>(options.height));
  write(ARV_FAKE_CAMERA_REGISTER_PIXEL_FORMAT, options.format);
  write(ARV_FAKE_CAMERA_REGISTER_ACQUISITION_FRAME_PERIOD_US, static_cast<std::uint32_t>(1e6 / options.rate_Hz));
  aravis::setFillPattern(arv_gv_fake_camera_get_fake_camera(camera_), &Painter::paint, painter_.get());
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
