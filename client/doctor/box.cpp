#include "client/doctor/box.h"

#include "base/child.h"
#include "traction/control.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <sys/timex.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <charconv>
#include <iterator>
#include <sstream>

namespace traction::doctor {

namespace fs = std::filesystem;

Box::Reading Box::read(const std::string& path) const {
  constexpr std::size_t kMost = 1 << 20;
  // Opening or reading a pipe or a device could block.
  const int file = open(at(path).c_str(), O_RDONLY | O_NONBLOCK | O_CLOEXEC);
  if (file < 0) return {.text = {}, .error = errno};
  Reading reading;
  std::array<char, 16384> part{};
  ssize_t size = 0;
  while (reading.text.size() < kMost && (size = ::read(file, part.data(), part.size())) > 0) {
    reading.text.append(part.data(), static_cast<std::size_t>(size));
  }
  if (size < 0) reading.error = errno;
  close(file);
  return reading;
}

std::optional<std::string> Box::line(const std::string& path) const {
  const Reading reading = read(path);
  if (!reading) return std::nullopt;
  std::string first = reading.text.substr(0, reading.text.find('\n'));
  const std::size_t start = first.find_first_not_of(" \t");
  return start == std::string::npos ? "" : first.substr(start, first.find_last_not_of(" \t\r") + 1 - start);
}

std::optional<double> Box::number(const std::string& path) const {
  const auto text = line(path);
  double value = 0.0;
  if (!text) return std::nullopt;
  const auto [end, error] = std::from_chars(text->data(), text->data() + text->size(), value);
  return error == std::errc() && end == text->data() + text->size() ? std::optional(value) : std::nullopt;
}

Box::Listing Box::list(const std::string& path) const {
  Listing listing;
  std::error_code failure;
  for (fs::directory_iterator each(at(path), failure), end; !failure && each != end; each.increment(failure)) {
    listing.names.push_back(each->path().filename());
  }
  std::sort(listing.names.begin(), listing.names.end());
  listing.error = failure.value();
  return listing;
}

Box::FileStatus Box::fileStatus(const std::string& path) const {
  struct stat found {};
  if (stat(at(path).c_str(), &found) != 0) return {.error = errno};
  return {.error = 0, .user = found.st_uid, .group = found.st_gid, .mode = found.st_mode & 07777U};
}

std::optional<bool> Box::keepsTime() const {
  timex asked{};
  if (adjtimex(&asked) < 0) return std::nullopt;
  return (asked.status & STA_UNSYNC) == 0;
}

Box::Answer Box::status(const std::string& instance) const try {
  ControlOptions options;
  options.instance = instance;
  return {Control(options).status(), {}};
} catch (const Error& error) {
  return {{}, error.what()};
}

std::optional<Box::Ran> Box::run(const std::vector<std::string>& words) const {
  tractiond::ChildEnd end = tractiond::runChild({words.begin() + 1, words.end()}, {.program = words[0]});
  if (end.how != tractiond::ChildEnd::How::kExit) return std::nullopt;
  return Ran{end.code, std::move(end.output), std::move(end.errors)};
}

std::vector<std::string> wordsOf(const std::string& line) {
  std::istringstream words(line);
  return {std::istream_iterator<std::string>(words), std::istream_iterator<std::string>()};
}

std::vector<std::string> linesOf(const std::string& text) {
  std::vector<std::string> lines;
  std::istringstream stream(text);
  for (std::string line; std::getline(stream, line);) lines.push_back(line);
  return lines;
}

}  // namespace traction::doctor
