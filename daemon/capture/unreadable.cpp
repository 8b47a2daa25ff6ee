// Strategy. Follows the way that Aravis goes: the URL in the bootstrap registers, the memory that it names, the text.
#include "daemon/capture/unreadable.h"

#include "daemon/capture/description_check.h"
#include "daemon/capture/gvcp_search.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cstdint>
#include <cstdio>
#include <optional>
#include <string>
#include <string_view>

namespace tractiond::capture {
namespace {

// GigE Vision 2.0, 28: registers that hold the URLs of the description, as text.
constexpr std::array<std::uint32_t, 2> kUrls{0x200, 0x400};
constexpr std::uint32_t kUrlSize = 512;
constexpr std::uint64_t kLargest_bytes = 16 << 20;
constexpr unsigned kAccessDenied = 0x8006;

constexpr const char* kFirmware = "its firmware may be damaged: load it again with the maker's tool";

std::string unreadable(const std::string& why) {
  std::string sentence = "the camera answers, but its description cannot be read: ";
  return sentence.append(why);
}

/// Of a text of the camera's up to its zero byte, what can be shown.
std::string shown(std::string_view bytes) {
  std::string text(bytes.substr(0, std::min(bytes.find('\0'), bytes.size())));
  std::replace_if(
      text.begin(), text.end(), [](char c) { return g_ascii_isprint(c) == 0; }, '?');
  return text;
}

std::string lower(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(), [](char c) { return g_ascii_tolower(c); });
  return text;
}

std::string refused(unsigned status) {
  std::array<char, 8> code{};
  std::snprintf(code.data(), code.size(), "0x%04x", status);
  return std::string("the camera answers, but refuses to be read (") + code.data() +
         (status == kAccessDenied ? ", access denied); another client may hold it alone: close that client"
                                  : "); power it off and on");
}

/// "camera.xml;1a0000;8f3c", behind the scheme: a place in the camera's memory.
struct Place {
  std::string name;
  std::uint64_t address = 0, size = 0;
};
bool parse(std::string_view path, Place& place) {
  const auto first = path.find(';'), second = path.find(';', first == path.npos ? first : first + 1);
  if (second == path.npos) return false;
  place.name = path.substr(0, first);
  const auto number = [](std::string_view digits, std::uint64_t& value) {
    if (digits.substr(0, 2) == "0x") digits.remove_prefix(2);
    return !digits.empty() &&
           std::from_chars(digits.data(), digits.data() + digits.size(), value, 16).ec == std::errc();
  };
  return number(path.substr(first + 1, second - first - 1), place.address) &&
         number(path.substr(second + 1), place.size);
}

/// What the registers say of where the description is.
struct Found {
  std::string why = {};             ///< why that is no place; else empty
  std::string url = {};             ///< empty: the camera does not answer
  std::optional<Place> place = {};  ///< none: outside of the camera
  bool tooLarge = false;            ///< why `why` is set
};
Found find(const std::string& address) {
  GvcpSearch camera;
  if (camera.ask(address, std::chrono::milliseconds(300)).empty()) return {};
  std::string url;
  for (const std::uint32_t at : kUrls) {
    const GvcpSearch::Memory memory = camera.read(address, at, kUrlSize);
    if (memory.refusal != 0) return {.why = refused(memory.refusal)};
    if (memory.bytes.empty()) return {.why = "the camera answers, but not when it is read; power it off and on"};
    if (url = shown(memory.bytes); !url.empty()) break;
  }
  const auto none = [](const std::string& why) { return Found{.why = unreadable(why + "; " + kFirmware)}; };
  if (url.empty()) return none("it states no place (URL) of it");
  const std::string scheme = lower(url.substr(0, url.find(':')));
  if (scheme == "http" || scheme == "https" || scheme == "file") return {.url = url};
  std::string_view path = std::string_view(url).substr(std::min(scheme.size() + 1, url.size()));
  while (!path.empty() && path.front() == '/') path.remove_prefix(1);
  Place place;
  if (scheme != "local" || !parse(path, place)) return none("\"" + url + "\" is no place of it");
  if (place.size == 0) return none("that at \"" + url + "\" is empty");
  if (place.size > kLargest_bytes || place.address > UINT32_MAX - kLargest_bytes) {
    Found found = none("that at \"" + url + "\" is larger than any camera's");
    found.tooLarge = true;
    return found;
  }
  return {.url = url, .place = place};
}

/// Returns why a text is no description of a camera, as the end of a sentence; empty: it looks like one.
std::string whyNoDescription(std::string_view text) {
  if (std::all_of(text.begin(), text.end(), [](char c) { return c == '\0' || g_ascii_isspace(c) != 0; }))
    return "is empty";
  if (lower(std::string(text.substr(0, 4096))).find("<html") != text.npos) return "is HTML, no GenICam description";
  if (text.find("<RegisterDescription") == text.npos) return "is no GenICam description";
  constexpr std::string_view kSubject = "the camera's description ";
  const std::string fault = faultOfText(text);
  return fault.empty() ? fault : fault.substr(kSubject.size());
}

}  // namespace

std::string whyTooLarge(const std::string& address) {
  const Found found = find(address);
  return found.tooLarge ? found.why : "";
}

std::string whyUnreadable(const std::string& address) {
  const Found found = find(address);
  if (found.url.empty() || !found.why.empty()) return found.why;
  const std::string what = unreadable("that at \"" + found.url + "\" ");
  if (!found.place)
    return what + "is not in the camera; load a firmware with a description into it, with the maker's tool";
  GvcpSearch camera;
  const auto whole = static_cast<std::uint32_t>((found.place->size + 3) / 4 * 4);
  const GvcpSearch::Memory memory = camera.read(address, static_cast<std::uint32_t>(found.place->address), whole);
  if (memory.refusal != 0) return refused(memory.refusal);
  if (memory.bytes.empty()) return what + "does not come; power it off and on";
  if (lower(found.place->name).ends_with(".zip")) {
    if (!memory.bytes.starts_with("PK")) return what + "is no zip file; " + kFirmware;
    return what + "does not unpack, or to none that is whole; " + kFirmware;
  }
  const std::string why = whyNoDescription(std::string_view(memory.bytes).substr(0, found.place->size));
  if (!why.empty()) return what + why + "; " + kFirmware;
  return "the camera answers, and its description at \"" + found.url +
         "\" is whole, but it does not open; power it off and on";
}

}  // namespace tractiond::capture
