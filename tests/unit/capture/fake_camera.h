// Aravis's GigE Vision camera that does not exist.
#pragma once

#include <sys/types.h>

#include <cstdint>
#include <memory>
#include <string>

struct _ArvGvFakeCamera;

namespace tractiond::test {

/// A camera in this process. Every picture begins with its own number, as 8 bytes.
class FakeCamera {
 public:
  struct Options {
    std::string address = "127.0.0.1";
    std::string serial = "GV01";
    int width = 64, height = 48;
    std::uint32_t format = 0x02180014;  ///< RGB8
    double rate_Hz = 100;
  };
  explicit FakeCamera(const Options& options);
  FakeCamera()
      : FakeCamera(Options{}) {}
  ~FakeCamera();

  void write(std::uint32_t address, std::uint32_t value);
  std::uint32_t read(std::uint32_t address) const;

 private:
  struct Painter;
  std::unique_ptr<Painter> painter_;
  _ArvGvFakeCamera* camera_;
};

}  // namespace tractiond::test
