#include "client/doctor/checks.h"
#include "client/show/json_writer.h"
#include "client/src/printable.h"

#include <algorithm>
#include <cctype>

namespace traction::doctor {

namespace {

const char* wordOf(Verdict verdict) {
  switch (verdict) {
  case Verdict::kOk:
    return "OK";
  case Verdict::kUnknown:
    return "?";
  case Verdict::kWarn:
    return "WARN";
  case Verdict::kFail:
    break;
  }
  return "FAIL";
}

}  // namespace

std::string reportText(const std::vector<Finding>& findings) {
  const auto nameOf = [](const Finding& one) {
    return one.instance.empty() ? one.check : one.instance + ": " + one.check;
  };
  constexpr std::size_t kVerdictWidth = 6;
  std::size_t widest = 0;
  for (const Finding& one : findings) widest = std::max(widest, nameOf(one).size());
  std::string text;
  for (const Finding& one : findings) {
    std::string word = wordOf(one.verdict), name = nameOf(one);
    word.resize(kVerdictWidth, ' ');
    name.resize(widest + 2, ' ');
    text.append(word).append(name).append(printable(one.found)).append(1, '\n');
    if (!one.mend.empty()) text.append(kVerdictWidth, ' ').append(printable(one.mend)).append(1, '\n');
  }
  return text;
}

std::string reportJson(const std::vector<Finding>& findings) {
  client::Json json;
  json.open('{').key("checks").open('[');
  for (const Finding& one : findings) {
    std::string word = one.verdict == Verdict::kUnknown ? "unknown" : wordOf(one.verdict);
    std::transform(word.begin(), word.end(), word.begin(), [](unsigned char c) { return std::tolower(c); });
    json.open('{').key("check").string(one.check).key("instance").string(one.instance).key("verdict").string(word);
    json.key("found").string(printable(one.found)).key("mend").string(printable(one.mend)).close('}');
  }
  return json.close(']').key("exit_code").number(exitCodeOf(findings)).close('}').take();
}

int exitCodeOf(const std::vector<Finding>& findings) {
  const auto has = [&](Verdict verdict) {
    return std::any_of(findings.begin(), findings.end(), [&](const Finding& one) { return one.verdict == verdict; });
  };
  return has(Verdict::kFail) ? 2 : has(Verdict::kWarn) ? 1 : 0;
}

}  // namespace traction::doctor
