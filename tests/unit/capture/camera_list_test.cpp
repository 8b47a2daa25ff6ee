#include "daemon/capture/camera_list.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <string>

namespace tractiond::capture::camera_list_test {
namespace {

namespace fs = std::filesystem;

/// A kernel's tables with devices of our choice.
class UsbTables : public testing::Test {
 protected:
  UsbTables() { fs::create_directories(root_ / "sys/bus/usb/devices"); }
  ~UsbTables() override { fs::remove_all(root_); }

  void device(const std::string& name, const std::string& product, int number, const std::string& ofClass,
              const std::string& subclass, bool node) {
    const fs::path devices = root_ / "sys/bus/usb/devices";
    const auto line = [&](const fs::path& folder, const char* file, const std::string& text) {
      fs::create_directories(devices / folder);
      std::ofstream(devices / folder / file) << text << "\n";
    };
    line(name, "manufacturer", "Basler");
    line(name, "product", product);
    line(name, "serial", "4711");
    line(name, "busnum", "2");
    line(name, "devnum", std::to_string(number));
    for (const char* interface : {":1.0", ":1.1"}) {
      line(name + interface, "bInterfaceClass", ofClass);
      line(name + interface, "bInterfaceSubClass", subclass);
    }
    char file[8];
    std::snprintf(file, sizeof file, "%03d", number);
    fs::create_directories(root_ / "dev/bus/usb/002");
    if (node) std::ofstream(root_ / "dev/bus/usb/002" / file) << "";
  }

  fs::path root_ = fs::path(testing::TempDir()) / ("usb-tables-" + std::to_string(getpid()));
};

TEST_F(UsbTables, TellWhichCamerasCannotBeOpenedAndWhy) {
  device("2-1", "acA640", 3, "ef", "05", true);
  device("2-2", "Keyboard", 4, "03", "01", true);
  device("2-3", "Blackfly", 12, "ef", "05", false);
  const auto closed = closedUsbCameras({}, root_ / "sys", root_ / "dev");
  ASSERT_EQ(closed.size(), 2U);
  EXPECT_EQ(closed[0].name.model, "acA640");
  EXPECT_EQ(closed[0].name.physicalId, root_ / "dev/bus/usb/002/003");
  EXPECT_EQ(closed[0].obstacle, "Aravis does not see it");
  EXPECT_EQ(closed[1].name.model, "Blackfly");
  EXPECT_NE(closed[1].obstacle.find("no permission"), std::string::npos);
}

TEST_F(UsbTables, LeaveOutWhatAravisListsAndMayBeOpened) {
  device("2-1", "acA640", 3, "ef", "05", true);
  CameraSight listed;
  listed.name.serial = "4711";
  EXPECT_TRUE(closedUsbCameras({listed}, root_ / "sys", root_ / "dev").empty());
}

}  // namespace
}  // namespace tractiond::capture::camera_list_test
