#include "client/doctor/box.h"

#include "base/child.h"
#include "base/whole_file.h"
#include "traction/control.h"

#include <sys/stat.h>
#include <sys/timex.h>

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <iterator>
#include <sstream>

namespace traction::doctor {

namespace fs = std::filesystem;

tl::expected<std::string, std::error_code> Box::read(const std::string& path) const {
  constexpr std::size_t kMost = 1 << 20;
  return tractiond::readWholeFile(at(path), kMost).map([](const std::vector<char>& bytes) {
    return std::string(bytes.begin(), bytes.end());
  });
}

std::vector<std::string> Box::lines(const std::string& path) const {
  return linesOf(read(path).value_or(""));
}

std::optional<std::string> Box::line(const std::string& path) const {
  const auto text = read(path);
  if (!text) return std::nullopt;
  std::string first = text->substr(0, text->find('\n'));
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

std::vector<std::string> Box::list(const std::string& path) const {
  std::vector<std::string> names;
  std::error_code failure;
  for (fs::directory_iterator each(at(path), failure), end; !failure && each != end; each.increment(failure)) {
    names.push_back(each->path().filename());
  }
  std::sort(names.begin(), names.end());
  return names;
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

tl::expected<traction::Status, std::string> Box::status(const std::string& instance) const try {
  ControlOptions options;
  options.instance = instance;
  return Control(options).status();
} catch (const Error& error) {
  return tl::unexpected<std::string>(error.what());
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
