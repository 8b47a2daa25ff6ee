#include "client/doctor/checks.h"
#include "tests/support/temporary_folder.h"
#include "traction/v1/status.pb.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <functional>
#include <map>
#include <memory>
#include <set>
#include <utility>

namespace traction::doctor::doctor_test {
namespace {

/// A box that does not exist: files in a directory of its own, with owners that a test makes up.
class FakeBox : public Box {
 public:
  FakeBox()
      : FakeBox(std::make_unique<tractiond::test::TemporaryFolder>()) {}

  void write(const std::string& path, const std::string& text, FileStatus owner = {0, 0, 0, 0644}) {
    std::filesystem::create_directories((folder_ / path.substr(1)).parent_path());
    std::ofstream(folder_ / path.substr(1)) << text;
    owners_[path] = owner;
  }
  void makeDirectory(const std::string& path, FileStatus owner = {0, 0, 0, 0755}) {
    std::filesystem::create_directories(folder_ / path.substr(1));
    owners_[path] = owner;
  }
  void remove(const std::string& path) { std::filesystem::remove_all(folder_ / path.substr(1)); }
  void own(const std::string& path, FileStatus owner) { owners_[path] = owner; }
  FileStatus fileStatus(const std::string& path) const override {
    const FileStatus real = Box::fileStatus(path);
    const auto owner = owners_.find(path);
    return real.error != 0 || owner == owners_.end() ? real : owner->second;
  }
  std::optional<bool> keepsTime() const override { return timeIsKept; }
  std::optional<Ran> run(const std::vector<std::string>& words) const override {
    std::string line;
    for (const std::string& word : words) line += (line.empty() ? "" : " ") + word;
    for (const auto& [part, ran] : programs) {
      if (line.find(part) != std::string::npos) return ran;
    }
    return std::nullopt;
  }

  tl::expected<Status, std::string> status(const std::string&) const override {
    if (!published) return tl::unexpected<std::string>("no answer");
    return Status{{}, std::make_shared<v1::Status>(*published)};
  }

  std::optional<v1::Status> published;  ///< by the daemon of each instance; none: it does not answer
  std::optional<bool> timeIsKept = true;
  std::map<std::string, Ran> programs;  ///< by a part of their command lines

 private:
  explicit FakeBox(std::unique_ptr<tractiond::test::TemporaryFolder> folder)
      : Box(folder->path())
      , temporary_(std::move(folder)) {}

  std::unique_ptr<tractiond::test::TemporaryFolder> temporary_;
  const std::filesystem::path& folder_ = temporary_->path();
  std::map<std::string, FileStatus> owners_;
};

std::set<std::string> checksOf(const std::vector<Finding>& findings, std::initializer_list<Verdict> verdicts) {
  std::set<std::string> checks;
  for (const Finding& one : findings) {
    if (std::find(verdicts.begin(), verdicts.end(), one.verdict) != verdicts.end()) checks.insert(one.check);
  }
  return checks;
}

const std::string kDaemon = "/opt/bin/tractiond";
constexpr std::uint32_t kUser = 990;
const std::string kMtu = "/sys/class/net/camera0/mtu";
const std::string kFilters = "/proc/sys/net/ipv4/conf/", kManaged = "/run/NetworkManager/devices/3";

/// Puts a key's value into what the daemon prints of its configuration.
void configure(FakeBox& box, bool onNetwork, int packet_bytes = 0) {
  box.programs[kDaemon + " --instance default --print-config"] = {
      0,
      std::string("[camera]\nid = \"") + (onNetwork ? "192.168.77.2" : "Maker-123") +
          "\"\nreceive_buffer_bytes = 8388608\npacket_size_bytes = " + std::to_string(packet_bytes) +
          "\n[log]\nlevel = \"info\"\n",
      ""};
}

void answerUnit(FakeBox& box, const std::string& load, const std::string& file, const std::string& active) {
  box.programs["systemctl show tractiond@default.service"] = {
      0,
      "Result=exit-code\nNRestarts=3\nLoadState=" + load + "\nActiveState=" + active + "\nUnitFileState=" + file + "\n",
      ""};
}

/// A box on which nothing is wrong, with a camera on USB or in the network.
struct HealthyBox : FakeBox {
  explicit HealthyBox(bool onNetwork) {
    makeDirectory("/sys/devices/system/cpu/cpufreq");  // not a processor
    for (const char* cpu : {"0", "1"})
      write("/sys/devices/system/cpu/cpu" + std::string(cpu) + "/cpufreq/scaling_governor", "performance\n");
    write("/etc/udev/rules.d/60-tractiond.rules", "");
    makeDirectory("/sys/bus/usb");
    write("/etc/passwd", "root:x:0:0::/root:/bin/sh\ntractiond2:x:5:5::/:/bin/sh\ntractiond:x:990:991::/:/bin/false\n");
    write("/etc/group", "root:x:0:\nada:x:1000:\ntractiond:x:991:\n");
    inGroups("27 991 1000");
    programs[kDaemon + " --instance default --config /etc/tractiond/default.toml --check-config"] = {0, "", ""};
    write("/etc/tractiond/default.toml", "");
    configure(*this, onNetwork);
    answerUnit(*this, "loaded", "enabled", "active");
    write("/proc/net/route", "Iface\tDestination\tGateway\tFlags\tRefCnt\tUse\tMetric\tMask\tMTU\tWindow\tIRTT\n"
                             "eth0\t00000000\t010200C0\t0003\t0\t0\t0\t00000000\t0\t0\t0\n"
                             "camera0\t004DA8C0\t00000000\t0001\t0\t0\t0\t00FFFFFF\t0\t0\t0\n"
                             "down0\t024DA8C0\t00000000\t0000\t0\t0\t0\tFFFFFFFF\t0\t0\t0\n");
    write("/proc/net/arp", "IP address HW type Flags HW address Mask Device\n"
                           "192.168.77.2 0x1 0x2 00:30:53:1a:2b:3c * camera0\n");
    write("/proc/sys/net/core/rmem_max", "8388608\n");
    write("/sys/class/net/eth0/mtu", "100\n");  // not the camera's
    write(kMtu, "9000\n");
    filter("1\n", "2\n");
    write("/sys/class/net/camera0/ifindex", "3\n");
    write("/run/NetworkManager/devices/2", "[device]\nmanaged=true\n");
    write(kManaged, "[device]\nmanaged=false\n");
    published.emplace();
    published->set_camera(v1::CAMERA_STATE_STREAMING);
    published->mutable_rates()->set_received_hz(60.0);
    published->mutable_rates()->set_published_hz(60.0);
  }
  void inGroups(const std::string& groups) {
    write("/proc/self/status",
          "Name:\tx\nUid:\t1000\t1000\t1000\t1000\nGid:\t1000\t1000\t1000\t1000\nGroups:\t" + groups + " \n");
  }
  void filter(const char* all, const char* camera) {
    write(kFilters + "all/rp_filter", all);
    write(kFilters + "camera0/rp_filter", camera);
  }
};

struct Fault {
  const char* check;
  std::function<void(HealthyBox&)> make;
};

/// Returns a fault of owner or mode.
Fault owned(const char* check, const char* path, const Box::FileStatus& owner) {
  return {check, [=](HealthyBox& box) { box.own(path, owner); }};
}

const std::vector<Fault> kEverywhere = {
    {"governor", [](auto& box) { box.write("/sys/devices/system/cpu/cpu1/cpufreq/scaling_governor", "powersave\n"); }},
    {"time of day", [](auto& box) { box.timeIsKept = false; }},
    {"user and group", [](auto& box) { box.inGroups("27 9910"); }},
    owned("configuration", "/etc/tractiond/default.toml", {0, 0, 0, 0640}),
    owned("configuration", "/etc/tractiond/default.toml", {0, 0, kUser, 0600}),
    {"service", [](auto& box) { answerUnit(box, "not-found", "", "inactive"); }},
    {"service", [](auto& box) { answerUnit(box, "loaded", "disabled", "active"); }},
    {"service", [](auto& box) { answerUnit(box, "loaded", "enabled", "failed"); }},
    {"service", [](auto& box) { answerUnit(box, "loaded", "enabled", "inactive"); }},
    {"receive buffer", [](auto& box) { box.write("/proc/sys/net/core/rmem_max", "8388607\n"); }},
    {"measurement", [](auto& box) { box.published->set_camera(v1::CAMERA_STATE_LOST); }},
    {"measurement", [](auto& box) { box.published->set_invalid_why("too few markers"); }},
    {"measurement", [](auto& box) { box.published->mutable_rates()->set_received_hz(0.0); }},
    {"measurement", [](auto& box) { box.published->mutable_rates()->set_published_hz(0.0); }},
    {"measurement", [](auto& box) { box.published->mutable_markers()->set_remark("the gel file does not fit"); }},
};
const std::vector<Fault> kOfUsb = {
    {"USB permissions", [](auto& box) { box.remove("/etc/udev/rules.d/60-tractiond.rules"); }},
};
const std::vector<Fault> kOfTheNetwork = {
    {"MTU", [](auto& box) { box.write(kMtu, "8999\n"); }},
    {"MTU", [](auto& box) { configure(box, true, 9001); }},
    {"reverse path", [](auto& box) { box.filter("1\n", "0\n"); }},
    {"reverse path", [](auto& box) { box.filter("0\n", "1\n"); }},
    {"NetworkManager", [](auto& box) { box.write(kManaged, "[device]\nmanaged=true\nnm-owned=false\n"); }},
};

TEST(Doctor, FindsEachFaultAndNothingElse) {
  const auto expectFaults = [](HealthyBox& box, bool onNetwork, const std::set<std::string>& expected) {
    const auto findings = examine(box, kDaemon, "");
    EXPECT_EQ(checksOf(findings, {Verdict::kWarn, Verdict::kFail}), expected) << reportText(findings);
    EXPECT_EQ(checksOf(findings, {Verdict::kUnknown}),
              onNetwork ? std::set<std::string>() : std::set<std::string>{"camera's link"});
    bool fails = false;
    for (const Finding& one : findings) {
      EXPECT_EQ(one.mend.empty(), !expected.contains(one.check)) << one.check;
      fails = fails || one.verdict == Verdict::kFail;
    }
    EXPECT_EQ(exitCodeOf(findings), fails ? 2 : expected.empty() ? 0 : 1);
  };
  for (const bool onNetwork : {false, true}) {
    HealthyBox healthy(onNetwork);
    expectFaults(healthy, onNetwork, {});
    std::vector<Fault> faults = kEverywhere;
    const auto& own = onNetwork ? kOfTheNetwork : kOfUsb;
    faults.insert(faults.end(), own.begin(), own.end());
    for (const Fault& fault : faults) {
      SCOPED_TRACE(testing::Message() << fault.check << ", fault " << &fault - faults.data());
      HealthyBox box(onNetwork);
      fault.make(box);
      expectFaults(box, onNetwork, {fault.check});
    }
  }
}

TEST(Doctor, ABoxThatShowsNothingIsNotKnown) {
  FakeBox box;
  box.timeIsKept.reset();
  const auto findings = examine(box, kDaemon, "");
  EXPECT_EQ(checksOf(findings, {Verdict::kUnknown}),
            (std::set<std::string>{"time of day", "service", "network", "measurement"}));
  EXPECT_EQ(checksOf(findings, {Verdict::kWarn, Verdict::kFail}), std::set<std::string>{"user and group"});
}

TEST(Doctor, ExaminesEachInstanceThatHasAConfigurationAUnitOrASocket) {
  FakeBox box;
  EXPECT_EQ(instancesOf(box), std::set<std::string>{"default"});
  box.write("/etc/tractiond/left.toml", "");
  box.write("/etc/tractiond/no name.toml", "");
  box.write("/etc/systemd/system/multi-user.target.wants/tractiond@right.service", "");
  box.write("/run/tractiond/third/control", "");
  box.makeDirectory("/run/tractiond/gone");
  EXPECT_EQ(instancesOf(box), (std::set<std::string>{"left", "right", "third"}));
}

TEST(Doctor, AWrongConfigurationIsNamedAndItsNetworkNotKnown) {
  FakeBox box;
  box.write("/etc/tractiond/left.toml", "nonsense");
  box.programs[kDaemon] = {78, "", "tractiond: left.toml:1: nonsense is no key\n"};
  for (const Finding& one : examine(box, kDaemon, "")) {
    if (one.check == "configuration") {
      EXPECT_EQ(one.verdict, Verdict::kFail);
      EXPECT_EQ(one.found, "left.toml:1: nonsense is no key");
      EXPECT_EQ(one.instance, "left");
    }
    if (one.check == "network") {
      EXPECT_EQ(one.verdict, Verdict::kUnknown);
    }
  }
}

TEST(Doctor, JsonHoldsWhateverWasRead) {
  const std::string text = reportJson({{"a", Verdict::kFail, "quote \" back \\ bell \x07 é", "do", "left"}});
  EXPECT_EQ(text, R"({"checks":[{"check":"a","instance":"left","verdict":"fail","found":"quote \" back \\ bell ? é",)"
                  R"("mend":"do"}],"exit_code":2})");
}

}  // namespace
}  // namespace traction::doctor::doctor_test
