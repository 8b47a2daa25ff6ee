#include "tests/unit/client/drawn_box.h"

#include <cstdlib>

namespace traction::doctor {
namespace {

constexpr std::uint32_t kUser = 990, kGroup = 991, kGateway = 992;

}  // namespace

DrawnBox::DrawnBox(unsigned seed)
    : random_(seed) {
  setenv("XDG_CONFIG_HOME", "/home/ada/.config", 1);
  onNetwork_ = coin();
  hasUser_ = one(5) != 0;
  drawMachine();
  drawUsb();
  drawUsers();
  drawKeys();
  drawOthers();
  drawInstance();
  drawNetwork();
  drawMeasurement();
}

void DrawnBox::drawMachine() {
  const std::string cpu = "/sys/devices/system/cpu/cpu", end = "/cpufreq/scaling_governor";
  const unsigned processors = one(12);
  const auto all = [=, this] {
    box.makeDirectory("/sys/devices/system/cpu/cpufreq");  // not a processor
    for (unsigned i = 0; i < processors; ++i) box.write(cpu + std::to_string(i) + end, "performance\n");
  };
  if (processors == 0) {
    all();
  } else {
    draw("governor", all, [&] {
      all();
      box.write(cpu + std::to_string(one(processors)) + end, any({"powersave\n", "ondemand\n", "schedutil\n"}));
    });
  }
  const std::string clock = "/sys/devices/system/clocksource/clocksource0/";
  box.write(clock + "available_clocksource", coin() ? "tsc hpet acpi_pm \n" : "hpet acpi_pm \n");
  const char* fast = any({"tsc\n", "kvm-clock\n", "arch_sys_counter\n"});
  draw(
      "clock source", [=, this] { box.write(clock + "current_clocksource", fast); },
      [&] {
        box.write(clock + "current_clocksource", any({"hpet\n", "acpi_pm\n", "jiffies\n"}));
      });
  draw(
      "time of day", [this] { box.timeIsKept = true; }, [this] { box.timeIsKept = false; });
}

void DrawnBox::drawUsb() {
  box.makeDirectory("/sys/bus/usb/devices");
  const std::string file = "/sys/module/usbcore/parameters/usbfs_memory_mb";
  const char* enough = any({"0\n", "1000\n", "2048\n"});
  const std::string rule =
      any({"/etc", "/usr/lib", "/lib", "/usr/local/lib"}) + std::string("/udev/rules.d/60-tractiond.rules");
  if (onNetwork_) {  // neither matters
    if (coin()) box.write(file, "16\n");
    if (coin()) box.write(rule, "");
    return;
  }
  draw(
      "USB memory", [=, this] { box.write(file, enough); },
      [&] {
        box.write(file, any({"16\n", "200\n", "999\n"}));
      });
  const unsigned cameras = hasUser_ ? one(3) : 0;
  const auto node = [](unsigned i) { return "/dev/bus/usb/002/0" + std::to_string(10 + i); };
  for (unsigned i = 0; i < 3; ++i) {
    const std::string device = "/sys/bus/usb/devices/2-" + std::to_string(i);
    const bool isCamera = i < cameras;
    box.write(device + "/busnum", "2\n");
    box.write(device + "/devnum", std::to_string(10 + i) + "\n");
    box.write(device + ":1.0/bInterfaceClass", isCamera ? "ef\n" : any({"03\n", "ef\n"}));
    box.write(device + ":1.0/bInterfaceSubClass", isCamera ? "05\n" : "02\n");
    box.write(node(i), "", {0, 0, 0, 0600});  // what is no camera may be closed
  }
  const auto good = [=, this] {
    box.write(rule, "");
    for (unsigned i = 0; i < cameras; ++i) box.own(node(i), {0, 0, kGroup, 0660});
  };
  draw("USB permissions", good, [&] {
    good();
    if (cameras == 0 || coin()) return box.remove(rule);
    box.own(node(one(cameras)), any<Box::FileStatus>({{0, 0, 0, 0660}, {0, 0, kGroup, 0640}, {0, 0, kGroup, 0600}}));
  });
}

void DrawnBox::drawUsers() {
  const std::string user = "root:x:0:0::/root:/bin/sh\ntractiond2:x:5:5::/:/bin/sh\n",
                    group = "root:x:0:\nada:x:1000:\n";
  const std::string known = "tractiond:x:" + std::to_string(kUser) + ":" + std::to_string(kGroup) + "::/:/bin/false\n";
  const auto made = [=, this] {
    box.write("/etc/passwd", user + known);
    box.write("/etc/group", group + "tractiond:x:" + std::to_string(kGroup) +
                                ":\ntraction-gateway:x:" + std::to_string(kGateway) + ":\n");
  };
  made();
  const auto in = [=, this] {
    made();
    box.write("/proc/self/status",
              "Name:\tx\nUid:\t1000\t1000\t1000\t1000\nGid:\t1000\t1000\t1000\t1000\nGroups:\t27 991 1000 \n");
  };
  in();
  if (!hasUser_) {
    bad.insert("user and group");
    cures.push_back(in);
    box.write("/etc/passwd", user);
    return;
  }
  draw("user and group", in, [&] {
    box.write("/proc/self/status",
              "Name:\tx\nUid:\t1000\t1000\t1000\t1000\nGid:\t1000\t1000\t1000\t1000\nGroups:\t27 9910 \n");
  });
}

void DrawnBox::drawKeys() {
  const std::string folder = "/etc/tractiond/keys";
  if (const unsigned kind = one(3); kind != 0) {
    const auto good = [=, this] {
      box.makeDirectory(folder);
      box.write(folder + "/gateway.secret", "", {0, 0, kGateway, 0640});
      box.write(folder + "/ada.key", "");
    };
    draw("keys", good, [&] {
      good();
      switch (one(7)) {
      case 0:
        return box.own(folder, {0, 0, kGateway, 0775});
      case 1:
        return box.own(folder, {0, 1000, 0, 0755});
      case 2:
        return box.own(folder + "/gateway.secret", {0, 0, kGateway, 0644});
      case 3:
        return box.own(folder + "/gateway.secret", {0, 0, 0, 0640});
      case 4:
        return box.own(folder + "/gateway.secret", {0, 0, kGateway, 0600});
      case 5:
        return box.own(folder + "/ada.key", {0, 0, 0, 0666});
      default:
        return box.own(folder + "/ada.key", {0, 1000, 0, 0644});
      }
    });
  }
  const std::string own = "/home/ada/.config/traction/key";
  if (coin()) return;
  draw(
      "your key",
      [=, this] {
        box.write(own, "", {0, 1000, 1000, 0600});
      },
      [&] {
        box.write(own, "", {0, 1000, 1000, any({0644U, 0640U, 0604U})});
      });
}

void DrawnBox::drawOthers() {
  box.start(1, "systemd");
  box.start(51, "tractiond", {kDaemon, "--check-config", "--instance=left"});  // a question, no daemon
  box.start(50, "bash", {"bash", "-c", "arv-viewer tractiond --instance left"});
  draw(
      "camera programs", [this] { box.remove("/proc/600"); },
      [&] {
        box.start(600, any({"arv-viewer-0.8", "arv-camera-test", "PylonViewerApp", "VimbaXViewer", "SpinView_QT"}));
      });
  if (onNetwork_) {
    if (coin()) box.start(601, "ModemManager");
  } else {
    draw(
        "ModemManager", [this] { box.remove("/proc/601"); }, [this] { box.start(601, "ModemManager"); });
  }
}

void DrawnBox::configure(const std::string& name, const std::string& camera) {
  const std::string text = "[camera]\nid = \"" + camera + "\"\npacket_socket = \"" + packetSocket_ +
                           "\"\nreceive_buffer_bytes = " + std::to_string(buffer_) +
                           "\npacket_size_bytes = " + std::to_string(packet_) + "\n" + realTime_ +
                           "[publish]\nstream = [" +
                           (port_ == 0 ? "" : "\"tcp://127.0.0.1:" + std::to_string(port_) + "\"") +
                           "]\nlatest = []\ncontrol = []\n[log]\nlevel = \"info\"\n";
  box.programs[kDaemon + " --instance " + name + " --print-config"] = {0, text, ""};
}

void DrawnBox::drawInstance() {
  name_ = coin() ? "default" : "left";
  const std::string file = "/etc/tractiond/" + name_ + ".toml";
  camera_ = onNetwork_ ? any({"192.168.77.2", "00:30:53:1A:2b:3c"}) : any({"", "Maker-123"});
  buffer_ = any({65536, 8388608, 33554432});
  packetSocket_ = "off";
  if (name_ != "default") port_ = 9000 + static_cast<int>(one(100));
  box.programs[kDaemon + " --instance " + name_ + " --config " + file + " --check-config"] = {0, "", ""};
  if (name_ != "default" || coin()) {
    const auto good = [=, this] { box.write(file, ""); };
    draw("configuration", good, [&] {
      box.write(file, "",
                hasUser_ ? any<Box::FileStatus>({{0, 0, 0, 0640}, {0, 1000, 1000, 0600}, {0, 0, kUser, 0600}})
                         : Box::FileStatus{0, 0, 0, 0600});
    });
    if (hasUser_ && coin() && !bad.contains("configuration")) box.own(file, {0, 0, kGroup, 0640});
  }
  packet_ = 0;
  configure(name_, camera_);
  box.start(700, "tractiond", {kDaemon, "--instance=" + name_});
  draw(
      "other daemons", [this] { box.remove("/proc/701"); },
      [this] {
        box.start(701, "tractiond", {kDaemon, "--instance", name_});
      });
  drawService();
  drawRealTime();
  drawState();
  drawPorts();
}

void DrawnBox::drawService() {
  const auto answer = [=, this](const std::string& load, const std::string& file, const std::string& active) {
    unit_ = "Result=exit-code\nNRestarts=3\nLoadState=" + load + "\nActiveState=" + active + "\nUnitFileState=" + file +
            "\n";
    answerUnit();
  };
  draw(
      "service", [=] { answer("loaded", "enabled", "active"); },
      [&] {
        switch (one(4)) {
        case 0:
          return answer("not-found", "", "inactive");
        case 1:
          return answer("loaded", "disabled", any({"active", "inactive"}));
        case 2:
          return answer("loaded", any({"enabled", "disabled"}), "failed");
        default:
          return answer("loaded", "enabled", "inactive");
        }
      });
  const auto limits = [=, this](const std::string& files, const std::string& memory) {
    files_ = files, memory_ = memory, limit();
  };
  draw(
      "limits", [=] { limits("65536", "unlimited"); },
      [&] { coin() ? limits("1024", "unlimited") : limits("65536", "1073741824"); });
}

void DrawnBox::limit() {
  box.write("/proc/700/limits", "Limit                     Soft Limit           Hard Limit           Units     \n"
                                "Max open files            256                  " +
                                    files_ +
                                    "               files     \n"
                                    "Max address space         unlimited            " +
                                    memory_ +
                                    "            bytes     \n"
                                    "Max realtime priority     0                    " +
                                    std::to_string(mostPriority_) +
                                    "                    \n"
                                    "Max locked memory         8388608              " +
                                    locked_ + "              bytes     \n");
}

void DrawnBox::answerUnit() {
  box.programs["systemctl show tractiond@" + name_ + ".service"] = {
      0, unit_ + "RestrictRealtime=" + (restricted_ ? "yes" : "no") + "\n", ""};
}

void DrawnBox::drawRealTime() {
  const int priority = coin() ? 1 + static_cast<int>(one(98)) : 0;
  const bool locks = coin(), pins = coin(), byCapability = coin();
  const unsigned processors = 1 + one(8);
  box.write("/sys/devices/system/cpu/online", processors == 1 ? "0\n" : "0-" + std::to_string(processors - 1) + "\n");
  const std::string within = std::to_string(one(processors));
  const std::string beyond = within + "," + std::to_string(processors + one(9));
  const auto ask = [=, this](const std::string& cpus) {
    realTime_ = "[realtime]\npriority = " + std::to_string(priority) + "\ncpus = \"" + cpus +
                "\"\nlock_memory = " + (locks ? "true" : "false") + "\n";
    configure(name_, camera_);
  };
  const auto allow = [=, this](int most, const std::string& locked, bool isCapable) {
    mostPriority_ = most, locked_ = locked, limit();
    box.write("/proc/700/status",
              std::string("Name:\ttractiond\nCapEff:\t") + (isCapable ? "0000000000804000\n" : "00000000fF7Fbfff\n"));
  };
  const auto restrict = [this](bool isRestricted) { restricted_ = isRestricted, answerUnit(); };
  const auto good = [=] {
    ask(pins ? within : "");
    restrict(false);
    byCapability ? allow(0, "65536", true) : allow(priority, locks ? "unlimited" : "65536", false);
  };
  if (priority == 0 && !locks && !pins) {
    good();
    return restrict(coin());
  }
  draw("real time", good, [&] {
    good();
    const unsigned kind = one(4);
    if (priority > 0 && kind == 0) return restrict(true);
    if (priority > 0 && kind == 1)
      return allow(static_cast<int>(one(static_cast<unsigned>(priority))), "unlimited", false);
    if (locks && kind != 3) return allow(98, any({"65536", "8388608"}), false);
    ask(beyond);
  });
}

void DrawnBox::drawState() {
  const std::string folder = "/var/lib/tractiond/" + name_;
  const auto good = [=, this] {
    box.room = Box::Space{false, std::uint64_t{400} << 20};
    if (hasUser_) box.makeDirectory(folder, {0, kUser, kGroup, 0700});
  };
  if (hasUser_ && coin()) return good();
  draw("state directory", good, [&] {
    good();
    switch (one(hasUser_ ? 4 : 2)) {
    case 0:
      box.room->readOnly = true;
      return;
    case 1:
      box.room->free_bytes = one(192 << 20);
      return;
    case 2:
      return box.own(folder, {0, 0, 0, 0755});
    default:
      return box.own(folder, {0, kUser, kGroup, 0500});
    }
  });
}

void DrawnBox::drawPorts() {
  const int port = name_ == "default" ? any({9872, 9873}) : port_;
  const auto listen = [=, this](const char* table, const char* state, const std::string& inode) {
    std::array<char, 200> line{};
    std::snprintf(line.data(), line.size(),
                  "  sl  local_address rem_address   st\n   0: 0100007F:%04X 00000000:0000 %s "
                  "00000000:00000000 00:00000000 00000000  0 0 %s 1 0 100 0 0 10 0\n",
                  static_cast<unsigned>(port), state, inode.c_str());
    box.write("/proc/net/tcp", "  sl  local_address rem_address   st\n");
    box.write("/proc/net/tcp6", "");
    box.write(table, line.data());
  };
  box.start(800, "nc");
  box.openSocket(800, "4711");
  box.openSocket(700, "4712");
  const bool ours = coin();
  draw(
      "ports", [=] { ours ? listen("/proc/net/tcp", "0A", "4712") : listen("/proc/net/tcp", "01", "4711"); },
      [&] {
        listen(any({"/proc/net/tcp", "/proc/net/tcp6"}), "0A", "4711");
      });
}

void DrawnBox::drawNetwork() {
  const auto route = [](const char* text) {
    return std::string("Iface\tDestination\tGateway\tFlags\tRefCnt\tUse\tMetric\tMask\tMTU\tWindow\tIRTT\n") + text;
  };
  box.write("/proc/net/route", route("eth0\t00000000\t010200C0\t0003\t0\t0\t0\t00000000\t0\t0\t0\n"
                                     "camera0\t004DA8C0\t00000000\t0001\t0\t0\t0\t00FFFFFF\t0\t0\t0\n"
                                     "down0\t024DA8C0\t00000000\t0000\t0\t0\t0\tFFFFFFFF\t0\t0\t0\n"));
  box.write("/proc/net/arp", "IP address HW type Flags HW address Mask Device\n"
                             "192.168.77.2 0x1 0x2 00:30:53:1a:2b:3c * camera0\n");
  const std::string most = "/proc/sys/net/core/rmem_max";
  draw(
      "receive buffer", [=, this] { box.write(most, std::to_string(buffer_) + "\n"); },
      [&] { box.write(most, std::to_string(buffer_ - 1) + "\n"); });
  draw(
      "packet filter", [this] { packetSocket_ = "off", configure(name_, camera_); },
      [&] {
        packetSocket_ = any({"on", "auto"}), configure(name_, camera_);
      });
  box.write("/sys/class/net/eth0/mtu", any({"100\n", "9000\n"}));  // not the camera's
  box.write("/proc/sys/net/ipv4/conf/eth0/rp_filter", any({"0\n", "1\n"}));
  if (!onNetwork_) {
    unknown.insert("camera's link");
    if (coin()) box.start(602, "NetworkManager");
    return;
  }
  const std::string mtu = "/sys/class/net/camera0/mtu";
  draw(
      "MTU", [=, this] { packet_ = 0, box.write(mtu, "9000\n"), configure(name_, camera_); },
      [&] {
        if (coin()) {
          box.write(mtu, any({"1500\n", "8999\n"}));
        } else {
          packet_ = 4001, box.write(mtu, "4000\n"), configure(name_, camera_);
        }
      });
  if (!bad.contains("MTU") && coin())
    box.write(mtu, "1500\n"), packet_ = 1500, configure(name_, camera_);  // as it is wanted
  const std::string folder = "/proc/sys/net/ipv4/conf/";
  const auto filter = [=, this](const char* all, const char* camera) {
    box.write(folder + "all/rp_filter", all);
    box.write(folder + "camera0/rp_filter", camera);
  };
  const bool loose = coin();
  draw(
      "reverse path", [=] { loose ? filter("1\n", "2\n") : filter("0\n", "0\n"); },
      [&] { coin() ? filter("1\n", "0\n") : filter("0\n", "1\n"); });
  box.write("/sys/class/net/camera0/ifindex", "3\n");
  box.write("/run/NetworkManager/devices/2", "[device]\nmanaged=true\n");
  const bool runs = coin();
  draw(
      "NetworkManager",
      [=, this] {
        if (runs) box.start(602, "NetworkManager");
        if (!runs) box.remove("/proc/602");
        box.write("/run/NetworkManager/devices/3", "[device]\nmanaged=false\n");
      },
      [this] {
        box.start(602, "NetworkManager");
        box.write("/run/NetworkManager/devices/3", "[device]\nmanaged=true\nnm-owned=false\n");
      });
}

void DrawnBox::drawMeasurement() {
  const auto good = [this] {
    v1::Status status;
    status.set_camera(v1::CAMERA_STATE_STREAMING);
    status.mutable_rates()->set_received_hz(60.0);
    status.mutable_rates()->set_published_hz(60.0);
    box.published = status;
  };
  draw("measurement", good, [&] {
    good();
    switch (one(5)) {
    case 0:
      return box.published->set_camera(v1::CAMERA_STATE_LOST);
    case 1:
      return box.published->set_invalid_why("too few markers");
    case 2:
      return box.published->mutable_rates()->set_received_hz(0.0);
    case 3:
      return box.published->mutable_rates()->set_published_hz(0.0);
    default:
      return box.published->mutable_markers()->set_remark("the gel file does not fit the picture");
    }
  });
}

}  // namespace traction::doctor
