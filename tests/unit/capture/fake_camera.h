// Aravis's GigE Vision camera that does not exist.
#pragma once

#include <cstdint>
#include <string>

struct _ArvGvFakeCamera;

namespace tractiond::test {

/// A camera in this process, of 64 x 48 pixels in RGB8.
class FakeCamera {
 public:
  struct Options {
    std::string address = "127.0.0.1";
    std::string serial = "GV01";
    double rate_Hz = 100;
  };
  explicit FakeCamera(const Options& options);
  FakeCamera()
      : FakeCamera(Options{}) {}
  ~FakeCamera();

  void write(std::uint32_t address, std::uint32_t value);
  std::uint32_t read(std::uint32_t address) const;

 private:
  _ArvGvFakeCamera* camera_;
};

}  // namespace tractiond::test
