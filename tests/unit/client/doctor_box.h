// Boxes that do not exist: files in a directory of their own, with owners that a test makes up.
#pragma once

#include "client/doctor/checks.h"
#include "tests/support/temporary_folder.h"
#include "traction/v1/status.pb.h"

#include <fstream>
#include <map>
#include <memory>
#include <utility>

namespace traction::doctor {

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
  void start(int id, const std::string& name, const std::vector<std::string>& words = {}) {
    std::string line;
    for (const std::string& word : words) line += word + '\0';
    write("/proc/" + std::to_string(id) + "/comm", name + "\n");
    write("/proc/" + std::to_string(id) + "/cmdline", line);
  }
  void openSocket(int id, const std::string& inode) {
    const auto folder = folder_ / "proc" / std::to_string(id) / "fd";
    std::filesystem::create_directories(folder);
    std::filesystem::create_symlink("socket:[" + inode + "]", folder / "7");
  }

  FileStatus fileStatus(const std::string& path) const override {
    const FileStatus real = Box::fileStatus(path);
    const auto owner = owners_.find(path);
    return real.error != 0 || owner == owners_.end() ? real : owner->second;
  }
  std::optional<Space> space(const std::string&) const override { return room; }
  std::optional<bool> keepsTime() const override { return timeIsKept; }
  std::optional<Ran> run(const std::vector<std::string>& words) const override {
    std::string line;
    for (const std::string& word : words) line += (line.empty() ? "" : " ") + word;
    for (const auto& [part, ran] : programs) {
      if (line.find(part) != std::string::npos) return ran;
    }
    return std::nullopt;
  }

  Answer status(const std::string&) const override {
    if (!published) return {{}, "no answer"};
    return {Status{{}, std::make_shared<v1::Status>(*published)}, {}};
  }

  std::optional<v1::Status> published;  ///< by the daemon of each instance; none: it does not answer
  std::optional<Space> room = Space{false, std::uint64_t{1} << 40};
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

}  // namespace traction::doctor
