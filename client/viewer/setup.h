// The guided first hour: what a page of --setup asks for, done by requests to the daemon and by traction-lens, with all
// files in one folder, so that each step can be left and taken up again.
#pragma once

#include "base/whole_file.h"
#include "traction/control.h"

#include <nlohmann/json.hpp>

#include <cstdint>
#include <filesystem>
#include <map>
#include <mutex>
#include <optional>
#include <stop_token>
#include <string>
#include <string_view>
#include <vector>

namespace traction::view {

/// A file that the page may read.
struct SetupFile {
  std::string type;     ///< MIME
  std::string content;  ///< empty: there is none of that name
};

/// What was measured is kept in setup.json, one member for each step, with the hashes of what it was made from and of
/// the file that it made: it holds as long as both are the same. carryOut() is for one thread at a time; the other
/// functions may be called by any thread meanwhile.
class Setup {
 public:
  /// Locks the folder as long as this exists.
  /// \param folder is created if it does not exist
  /// \param control of the daemon
  /// \param lens path of traction-lens
  /// \throws client::Failure if the folder cannot be made or another setup uses it, or setup.json is damaged
  Setup(std::filesystem::path folder, const ControlOptions& control, std::filesystem::path lens);

  /// Returns what there is, as JSON: {"folder", "steps": what setup.json has of the steps that hold, "stale": of the
  /// others, with "why", a sentence that says which step is to be repeated, "boards": [name], "files": [name] of what
  /// holds}.
  std::string state() const;

  /// Carries out one step, which may take minutes, and returns its result as JSON.
  /// \param request untrusted: {"do": step, ...}; docs/viewer.md lists them
  /// \throws Error kRefused with a sentence for the operator, and those of Control
  std::string carryOut(std::string_view request);

  /// Lets the step that is being carried out fail within a tenth of a second. What the daemon does for it goes on until
  /// it ends, or the next step begins.
  void cancel();
  /// Returns whether a request asks for that ({"do": "cancel"}).
  static bool isCancel(std::string_view request);

  /// Returns a file of the folder that holds, or the last picture ("look.jpg").
  /// \param name untrusted
  SetupFile file(std::string_view name) const;

 private:
  using Json = nlohmann::ordered_json;

  Json camera(const Json& request);
  Json look(const Json& request);
  Json takeBoard(const Json& request);
  Json removeBoard(const Json& request);
  Json fitLens(const Json& request);
  Json describeGel(const Json& request);
  Json printSheets(const Json& request);
  Json findPose(const Json& request);
  Json adopt(const Json& request);
  Json zero(const Json& request);
  Json measure(const Json& request);

  /// Asks the daemon, on a thread of its own, so that cancel() need not wait for the answer.
  template <typename Question>
  auto ask(Question question) const;
  Snapshot fullPicture() const;
  std::string path(const std::string& name) const { return (folder_ / name).string(); }
  bool has(const std::string& name) const;
  void forget(const std::vector<std::string>& names) const;
  std::vector<std::string> boards() const;
  std::string newBoard(const std::vector<std::string>& taken) const;
  void write(const std::string& name, const std::string& content) const;
  std::string plain(std::string text) const;
  /// Runs traction-lens. Returns its report, with the files' names alone.
  /// \throws Error kRefused with all its complaints, a line each
  Json runLens(std::vector<std::string> arguments) const;
  void keep(const std::string& step, Json result);
  Json kept(const char* step, const Json& otherwise) const;
  std::string fileHash(const std::string& name) const;
  std::string hashOf(const std::string& name) const;
  std::string whyStale(std::string_view step) const;
  void expect(const char* step, const std::string& otherwise) const;

  const std::filesystem::path folder_, lens_;
  std::optional<tractiond::OpenFile> lock_;
  const Control control_;
  mutable std::mutex mutex_;
  Json steps_ = Json::object();  ///< guarded by mutex_
  std::stop_source stop_;        ///< of the step that is being carried out; guarded by mutex_
  std::string look_;             ///< JPEG, guarded by mutex_
  struct Hashed {
    std::uintmax_t size = 0;
    std::filesystem::file_time_type time;
    std::string hash;
  };
  mutable std::map<std::string, Hashed> hashes_;  ///< by name; guarded by mutex_
};

}  // namespace traction::view
