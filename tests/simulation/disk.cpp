#include "tests/simulation/disk.h"

#include "base/files.h"

#include <fcntl.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <utility>

namespace tractiond::simulation {
namespace {

constexpr int kDirectory = 0;  // the node of the only one

int fail(int error) {
  errno = error;
  return -1;
}

}  // namespace

Disk*& disk() {
  static Disk* one = nullptr;
  return one;
}

void Disk::State::applyName(std::map<std::string, int>& names, const Operation& operation) {
  switch (operation.kind) {
  case Kind::kName:
    names[operation.path] = operation.node;
    break;
  case Kind::kUnname:
    names.erase(operation.path);
    break;
  case Kind::kRename:
    if (const auto from = names.find(operation.path); from != names.end()) {
      names[operation.other] = from->second;
      names.erase(operation.path);
    }
    break;
  default:
    break;
  }
}

void Disk::State::apply(const Operation& operation) {
  switch (operation.kind) {
  case Kind::kName:
  case Kind::kUnname:
  case Kind::kRename:
    applyName(names, operation);
    unsafe.push_back(operation);
    break;
  case Kind::kAppend:
    content[operation.node] += operation.bytes;
    break;
  case Kind::kSync:
    safeContent[operation.node] = content[operation.node];
    break;
  case Kind::kSyncNames:
    safeNames = names;
    unsafe.clear();
    break;
  }
}

void Disk::beginWork(std::int64_t begin_ns) {
  working_ = true;
  work_ns_ = begin_ns;
}

std::int64_t Disk::endWork() {
  working_ = false;
  return work_ns_;
}

Disk::Condition Disk::is() const {
  return condition ? condition(working_ ? work_ns_ : clocks().monotonic_ns) : Condition();
}

std::int64_t Disk::spend(std::int64_t cost_ns) {
  if (working_) return work_ns_ += cost_ns;
  waited_ns_ += cost_ns;
  return clocks().monotonic_ns;
}

int Disk::record(Operation operation, std::int64_t cost_ns) {
  operation.at_ns = spend(cost_ns);
  const auto isOver = [](const Operation& one) { return one.at_ns <= clocks().monotonic_ns; };
  if (std::ranges::all_of(recent_, isOver)) {
    before_ = now_;
    recent_.clear();
  }
  now_.apply(operation);
  recent_.push_back(std::move(operation));
  return 0;
}

Disk::State Disk::until(std::int64_t now_ns) const {
  State state = before_;
  for (const Operation& operation : recent_) {
    if (operation.at_ns <= now_ns) state.apply(operation);
  }
  return state;
}

void Disk::kill(std::int64_t now_ns) {
  before_ = now_ = until(now_ns);
  recent_.clear();
  files_.clear();
  working_ = false;
}

void Disk::losePower(std::int64_t now_ns, Chance& chance) {
  kill(now_ns);
  std::map<std::string, int> names = now_.safeNames;
  const std::size_t kept = chance.below(now_.unsafe.size() + 1);
  for (std::size_t i = 0; i < kept; ++i) State::applyName(names, now_.unsafe[i]);
  State left;
  for (const auto& [path, node] : names) {
    std::string content = now_.safeContent[node];
    const std::string& whole = now_.content[node];
    if (whole != content) {
      const std::size_t part = chance.below(whole.size() + 1);
      if (chance.oneIn(2)) content = whole.substr(0, part);
      if (chance.oneIn(4)) content.resize(whole.size());  // the size came first: the rest reads as zeros
    }
    left.content[node] = left.safeContent[node] = content;
  }
  left.names = left.safeNames = names;
  before_ = now_ = left;
}

std::optional<std::string> Disk::synchronised(const std::string& path) const {
  const State state = until(clocks().monotonic_ns);
  const auto name = state.safeNames.find(path);
  if (name == state.safeNames.end()) return std::nullopt;
  const auto content = state.safeContent.find(name->second);
  return content == state.safeContent.end() ? std::string() : content->second;
}

void Disk::put(const std::string& path, const std::string& content) {
  const int node = nextNode_++;
  for (State* state : {&before_, &now_}) {
    state->names[path] = state->safeNames[path] = node;
    state->content[node] = state->safeContent[node] = content;
  }
}

int Disk::open(const std::string& path, int flags) {
  spend((flags & (O_CREAT | O_DIRECTORY)) == 0 ? is().open_ns : kCall_ns);
  int node = kDirectory;
  if ((flags & O_DIRECTORY) == 0) {
    const auto name = now_.names.find(path);
    if (name == now_.names.end()) {
      if ((flags & O_CREAT) == 0) return fail(ENOENT);
      node = nextNode_++;
      record({.kind = Kind::kName, .node = node, .path = path}, 0);
    } else {
      if ((flags & O_EXCL) != 0) return fail(EEXIST);
      node = name->second;
    }
  }
  files_[nextFile_] = {node};
  return nextFile_++;
}

long Disk::read(int file, void* bytes, std::size_t count) {
  spend(kCall_ns);
  const auto it = files_.find(file);
  if (it == files_.end()) return fail(EBADF);
  const std::string& content = now_.content[it->second.node];
  const std::size_t given = std::min(count, content.size() - it->second.at);
  std::memcpy(bytes, content.data() + it->second.at, given);
  it->second.at += given;
  return static_cast<long>(given);
}

long Disk::write(int file, const void* bytes, std::size_t count) {
  const auto it = files_.find(file);
  if (it == files_.end()) return fail(EBADF);
  if (is().isFull) {
    spend(kCall_ns);
    return fail(ENOSPC);
  }
  const std::size_t some = count > 1 ? (count + 1) / 2 : count;  // a write may always be a short one
  const std::string content(static_cast<const char*>(bytes), some);
  record({.kind = Kind::kAppend, .node = it->second.node, .bytes = content}, kCall_ns);
  return static_cast<long>(some);
}

int Disk::fsync(int file) {
  const auto it = files_.find(file);
  if (it == files_.end()) return fail(EBADF);
  const int node = it->second.node;
  const Condition now = is();
  if (now.failsToSync) {
    spend(now.sync_ns);
    return fail(EIO);
  }
  return record({.kind = node == kDirectory ? Kind::kSyncNames : Kind::kSync, .node = node}, now.sync_ns);
}

int Disk::close(int file) {
  return files_.erase(file) == 1 ? 0 : fail(EBADF);
}

int Disk::rename(const std::string& from, const std::string& to) {
  if (!now_.names.contains(from)) return fail(ENOENT);
  return record({.kind = Kind::kRename, .path = from, .other = to}, kCall_ns);
}

int Disk::unlink(const std::string& path) {
  if (!now_.names.contains(path)) return fail(ENOENT);
  return record({.kind = Kind::kUnname, .path = path}, kCall_ns);
}

}  // namespace tractiond::simulation

namespace tractiond::files {

using simulation::disk;

int open(const char* path, int flags, mode_t /*mode*/) {
  if (disk() != nullptr) return disk()->open(path, flags);
  errno = ENOENT;
  return -1;
}
ssize_t read(int file, void* bytes, std::size_t count) {
  return disk()->read(file, bytes, count);
}
ssize_t write(int file, const void* bytes, std::size_t count) {
  return disk()->write(file, bytes, count);
}
int fsync(int file) {
  return disk()->fsync(file);
}
int close(int file) {
  return disk()->close(file);
}
int rename(const char* from, const char* to) {
  return disk()->rename(from, to);
}
int unlink(const char* path) {
  return disk()->unlink(path);
}
bool isRegular(int /*file*/) {
  return true;
}
std::error_code makeDirectories(const std::filesystem::path& /*path*/) {
  return {};
}

}  // namespace tractiond::files
