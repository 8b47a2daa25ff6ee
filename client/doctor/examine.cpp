#include "base/toml_table.h"
#include "client/doctor/checks.h"
#include "proto/traction/v1/endpoints.h"

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <set>

namespace traction::doctor {

namespace {

constexpr const char* kFolder = "/etc/tractiond";

/// Returns the settings by the daemon's own text of its configuration, which includes all defaults.
std::optional<Settings> settingsOf(const std::string& text) {
  auto root = tractiond::TomlTable::parse(text, "tractiond --print-config");
  if (!root) return std::nullopt;
  auto camera = root->table("camera");
  if (!camera) return std::nullopt;
  Settings settings;
  const tractiond::Range any{.least = 0.0, .most = 1e12};
  camera->read("id", settings.cameraId);
  camera->read("receive_buffer_bytes", settings.receiveBuffer_bytes, any);
  camera->read("packet_size_bytes", settings.packetSize_bytes, any);
  return settings;
}

void readSettings(const Patient& patient, Instance& instance) {
  std::vector<std::string> words = {patient.program, "--instance", instance.name, "--print-config"};
  if (const auto file = patient.box.read(instance.file); file) {
    words.insert(words.end(), {"--config", instance.file});
  } else if (file.error() != std::errc::no_such_file_or_directory) {
    instance.whyUnknown = instance.file + ": " + file.error().message();
    return;
  }
  const auto ran = patient.box.run(words);
  if (!ran) {
    instance.whyUnknown = patient.program + " cannot be run";
    return;
  }
  if (ran->exitCode == 0) instance.settings = settingsOf(ran->output);
  if (!instance.settings) instance.whyUnknown = "the configuration is wrong";
}

}  // namespace

std::set<std::string> instancesOf(const Box& box) {
  std::set<std::string> names;
  const auto add = [&](std::string name) {
    if (isValidName(name)) names.insert(std::move(name));
  };
  for (const std::string& file : box.list(kFolder)) {
    const std::filesystem::path path(file);
    if (path.extension() == ".toml") add(path.stem());
  }
  const std::string unit = "tractiond@", kind = ".service";
  for (const std::string& file : box.list("/etc/systemd/system/multi-user.target.wants")) {
    if (file.rfind(unit, 0) == 0 && file.size() > unit.size() + kind.size())
      add(file.substr(unit.size(), file.size() - unit.size() - kind.size()));
  }
  for (const std::filesystem::path& example : runtimeDirectories(kDefaultInstance)) {
    const std::string folder = example.parent_path();
    for (const std::string& name : box.list(folder)) {
      if (box.exists(std::string(folder).append("/").append(name).append("/control"))) add(name);
    }
  }
  if (names.empty()) names.insert(kDefaultInstance);
  return names;
}

Patient admit(const Box& box, const std::string& program, const std::string& instance) {
  Patient patient{box, program, {}};
  for (const std::string& name : instance.empty() ? instancesOf(box) : std::set<std::string>{instance}) {
    Instance one{name, std::string(kFolder).append("/").append(name).append(".toml"), {}, {}};
    readSettings(patient, one);
    patient.instances.push_back(std::move(one));
  }
  return patient;
}

std::optional<std::uint32_t> idOf(const Box& box, const std::string& file, const std::string& name) {
  for (const std::string& line : box.lines(file)) {  // name:x:id:...
    if (line.rfind(name + ":", 0) != 0) continue;
    const std::size_t start = line.find(':', name.size() + 1);
    if (start != std::string::npos) return static_cast<std::uint32_t>(std::strtoul(&line[start + 1], nullptr, 10));
  }
  return std::nullopt;
}

bool mayUseUsb(const Patient& patient) {
  const auto& all = patient.instances;
  return patient.box.exists("/sys/bus/usb") && !std::all_of(all.begin(), all.end(), [](const Instance& one) {
           return one.settings && isAddress(one.settings->cameraId);
         });
}

std::vector<Finding> examine(const Box& box, const std::string& program, const std::string& instance) {
  const Patient patient = admit(box, program, instance);
  std::vector<Finding> findings;
  checkMachine(patient, findings);
  for (const Instance& one : patient.instances) {
    const std::size_t before = findings.size();
    checkService(patient, one, findings);
    checkNetwork(patient, one, findings);
    for (std::size_t i = before; i < findings.size(); ++i) findings[i].instance = one.name;
  }
  return findings;
}

}  // namespace traction::doctor
