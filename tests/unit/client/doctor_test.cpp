#include "client/doctor/checks.h"
#include "tests/support/seed.h"
#include "tests/unit/client/drawn_box.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>

namespace traction::doctor::doctor_test {
namespace {

std::set<std::string> checksOf(const std::vector<Finding>& findings, std::initializer_list<Verdict> verdicts) {
  std::set<std::string> checks;
  for (const Finding& one : findings) {
    if (std::find(verdicts.begin(), verdicts.end(), one.verdict) != verdicts.end()) checks.insert(one.check);
  }
  return checks;
}

TEST(Doctor, FindsExactlyWhatIsWrong) {
  for (unsigned trial = 0; trial < 30; ++trial) {
    SCOPED_TRACE(testing::Message() << "trial " << trial);
    DrawnBox drawn(tractiond::test::seed() + trial);
    const auto findings = examine(drawn.box, kDaemon, "");
    ASSERT_EQ(checksOf(findings, {Verdict::kWarn, Verdict::kFail}), drawn.bad) << reportText(findings);
    ASSERT_EQ(checksOf(findings, {Verdict::kUnknown}), drawn.unknown) << reportText(findings);
    bool fails = false;
    for (const Finding& one : findings) {
      ASSERT_EQ(one.mend.empty(), !drawn.bad.contains(one.check)) << one.check;
      ASSERT_EQ(one.found.rfind("not known", 0) == 0, one.verdict == Verdict::kUnknown) << one.found;
      fails = fails || one.verdict == Verdict::kFail;
    }
    ASSERT_EQ(exitCodeOf(findings), fails ? 2 : drawn.bad.empty() ? 0 : 1);
    for (const auto& cure : drawn.cures) cure();
    const auto after = examine(drawn.box, kDaemon, "");
    ASSERT_EQ(checksOf(after, {Verdict::kWarn, Verdict::kFail}), std::set<std::string>()) << reportText(after);
    ASSERT_EQ(exitCodeOf(after), 0);
  }
}

TEST(Doctor, ABoxThatShowsNothingIsNotKnown) {
  FakeBox box;
  box.room.reset();
  box.timeIsKept.reset();
  const auto findings = examine(box, kDaemon, "");
  EXPECT_EQ(checksOf(findings, {Verdict::kUnknown}),
            (std::set<std::string>{"clock source", "time of day", "camera programs", "other daemons", "service",
                                   "state directory", "limits", "real time", "network", "measurement", "ports"}));
  EXPECT_EQ(checksOf(findings, {Verdict::kWarn, Verdict::kFail}), std::set<std::string>{"user and group"});
}

TEST(Doctor, AKeyFileThatCannotBeLookedAtIsNotKnown) {
  const std::string folder = "/etc/tractiond/keys";
  FakeBox box;
  box.makeDirectory(folder);
  box.write(folder + "/ada.key", "", {EACCES, 0, 0, 0});
  box.write(folder + "/bob.key", "");
  const auto verdicts = [&](Verdict verdict) {
    std::vector<Finding> findings;
    checkAccess(Patient{box, kDaemon, {}, {}}, findings);
    return checksOf(findings, {verdict});
  };
  EXPECT_TRUE(verdicts(Verdict::kUnknown).contains("keys"));
  EXPECT_FALSE(verdicts(Verdict::kOk).contains("keys"));
  box.own(folder + "/bob.key", {0, 0, 0, 0666});  // what is wrong is reported nevertheless
  EXPECT_TRUE(verdicts(Verdict::kFail).contains("keys"));
  EXPECT_FALSE(verdicts(Verdict::kUnknown).contains("keys"));
}

TEST(Doctor, KeysOfADirectoryThatCannotBeListedAreNotKnown) {
  FakeBox box;
  box.write("/etc/tractiond/keys", "");  // a file: also root cannot list it
  std::vector<Finding> findings;
  checkAccess(Patient{box, kDaemon, {}, {}}, findings);
  const auto keys = std::ranges::find(findings, "keys", &Finding::check);
  ASSERT_NE(keys, findings.end());
  EXPECT_EQ(keys->verdict, Verdict::kUnknown);
  EXPECT_EQ(keys->found, "not known: /etc/tractiond/keys cannot be listed: Not a directory");
}

TEST(Doctor, CamerasAndPortsOfAnInstanceThatIsNotKnownAreNot) {
  FakeBox box;
  box.write("/proc/net/tcp", "  sl  local_address rem_address   st\n");
  Instance left, right;
  left.name = "left", right.name = "right", right.whyUnknown = "the configuration is wrong";
  left.settings = Settings();
  const auto found = [&](const std::vector<Instance>& instances, const char* check) {
    std::vector<Finding> findings;
    checkCompetitors(Patient{box, kDaemon, {}, instances}, findings);
    const Finding one = *std::ranges::find(findings, check, &Finding::check);
    return one.verdict == Verdict::kUnknown ? one.found : one.verdict == Verdict::kOk ? "ok" : "wrong";
  };
  EXPECT_EQ(found({left, right}, "a camera each"), "not known: that of right: the configuration is wrong");
  EXPECT_EQ(found({left, right}, "ports"), "not known: those of right: the configuration is wrong");
  EXPECT_EQ(found({right}, "a camera each"), "ok");
  EXPECT_EQ(found({left}, "ports"), "ok") << "a kernel without IPv6 has no second table";
  box.remove("/proc/net/tcp");
  EXPECT_EQ(found({left}, "ports"), "not known: /proc/net/tcp: No such file or directory");
}

TEST(Doctor, ProcessesThatCannotBeSeenAreNotKnown) {
  FakeBox box;
  box.makeDirectory("/sys/bus/usb");
  box.write("/proc/net/tcp", "  sl  local_address rem_address   st\n"
                             "   0: 0100007F:2690 00000000:0000 0A 0:0 0:0 0  0 0 4711 1\n");
  const auto checks = [&](Verdict verdict) {
    Patient patient = admit(box, kDaemon, "default");
    patient.instances[0].settings = Settings{};
    patient.instances[0].settings->endpoints = {"tcp://127.0.0.1:9872"};
    std::vector<Finding> findings;
    checkCompetitors(patient, findings);
    return checksOf(findings, {verdict});
  };
  const std::set<std::string> all = {"camera programs", "ModemManager", "other daemons", "ports"};
  box.start(700, "bash");
  EXPECT_EQ(checks(Verdict::kUnknown), all) << "the first process is hidden, as others may be";
  box.start(1, "systemd");
  EXPECT_EQ(checks(Verdict::kUnknown), std::set<std::string>());
  EXPECT_EQ(checks(Verdict::kFail), std::set<std::string>{"ports"});
  box.makeDirectory("/proc/701/comm");
  EXPECT_EQ(checks(Verdict::kUnknown), all) << "a process cannot be looked at";
  box.start(702, "arv-viewer");
  EXPECT_EQ(checks(Verdict::kWarn), std::set<std::string>{"camera programs"}) << "what is seen is reported";
}

TEST(Doctor, ACameraWhoseDeviceCannotBeLookedAtIsNotKnown) {
  const std::string device = "/sys/bus/usb/devices/2-1";
  FakeBox box;
  box.write("/etc/udev/rules.d/60-tractiond.rules", "");
  box.write(device + "/busnum", "2\n");
  box.write(device + "/devnum", "7\n");
  box.write(device + ":1.0/bInterfaceClass", "ef\n");
  box.write(device + ":1.0/bInterfaceSubClass", "05\n");
  Instance instance;
  instance.settings = Settings();
  std::vector<Finding> findings;
  checkMachine(Patient{box, kDaemon, {}, {instance}}, findings);
  EXPECT_EQ(std::ranges::find(findings, "USB permissions", &Finding::check)->found,
            "not known: /dev/bus/usb/002/007: No such file or directory");
}

TEST(Doctor, RealTimeIsNotKnownWithoutTheUnit) {
  FakeBox box;
  box.start(700, "tractiond", {kDaemon});
  box.write("/proc/700/limits", "Max realtime priority     50                   50\n"
                                "Max locked memory         unlimited            unlimited            bytes\n");
  Instance instance;
  instance.name = "default";
  instance.file = "/etc/tractiond/default.toml";
  instance.settings = Settings();
  instance.settings->priority = 40;
  instance.processes = {700};
  const auto findings = [&](Verdict verdict) {
    std::vector<Finding> all;
    checkService(Patient{box, kDaemon, {}, {instance}}, instance, all);
    return checksOf(all, {verdict});
  };
  EXPECT_TRUE(findings(Verdict::kUnknown).contains("real time"));
  box.programs["systemctl show"] = {0, "LoadState=loaded\n", ""};
  EXPECT_TRUE(findings(Verdict::kUnknown).contains("real time"));
  box.programs["systemctl show"] = {0, "LoadState=loaded\nRestrictRealtime=no\n", ""};
  EXPECT_TRUE(findings(Verdict::kOk).contains("real time"));
}

TEST(Doctor, ADaemonThatDoesNotAnswerIsNotKnown) {
  FakeBox box;
  box.start(700, "tractiond", {kDaemon});
  const auto findings = examine(box, kDaemon, "");
  const auto found =
      std::find_if(findings.begin(), findings.end(), [](const Finding& one) { return one.check == "measurement"; });
  ASSERT_NE(found, findings.end());
  EXPECT_EQ(found->verdict, Verdict::kUnknown);
  EXPECT_EQ(found->found, "not known: no answer");
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

TEST(Doctor, InstancesThatTakeTheSameCameraAreNamed) {
  for (const char* id : {"", "Maker-1"}) {
    FakeBox box;
    for (const char* name : {"left", "right"}) box.write(std::string("/etc/tractiond/") + name + ".toml", "");
    const std::string rest = "\"\n[publish]\nstream = []\n";
    box.programs["left --print"] = {0, std::string("[camera]\nid = \"") + id + rest, ""};
    box.programs["right --print"] = {0, std::string("[camera]\nid = \"") + id + rest, ""};
    const auto shared = examine(box, kDaemon, "");
    EXPECT_TRUE(checksOf(shared, {Verdict::kFail}).contains("a camera each"));
    box.programs["right --print"] = {0, "[camera]\nid = \"Maker-2" + rest, ""};
    EXPECT_TRUE(checksOf(examine(box, kDaemon, ""), {Verdict::kOk}).contains("a camera each"));
  }
}

TEST(Doctor, JsonHoldsWhateverWasRead) {
  const std::string text = reportJson({{"a", Verdict::kFail, "quote \" back \\ bell \x07 é", "do", "left"}});
  EXPECT_EQ(text, R"({"checks":[{"check":"a","instance":"left","verdict":"fail","found":"quote \" back \\ bell ? é",)"
                  R"("mend":"do"}],"exit_code":2})");
}

TEST(Doctor, ProgramsAreRunToTheirEnd) {
  const Box box;
  const auto ran = box.run({"sh", "-c", "echo out; echo err >&2; yes | head -c 300000; exit 7"});
  ASSERT_TRUE(ran);
  EXPECT_EQ(ran->exitCode, 7);
  EXPECT_EQ(ran->output.size(), 300'004U);
  EXPECT_EQ(ran->complaint, "err\n");
  EXPECT_FALSE(box.run({"/nowhere/program"}));
}

}  // namespace
}  // namespace traction::doctor::doctor_test
