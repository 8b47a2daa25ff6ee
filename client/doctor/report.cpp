#include "base/json_writer.h"
#include "base/printable.h"
#include "client/doctor/checks.h"

#include <algorithm>
#include <array>
#include <cstddef>

namespace traction::doctor {

namespace {

// As Verdict has them.
constexpr std::array kWords = {"OK", "?", "WARN", "FAIL"};
constexpr std::array kJsonWords = {"ok", "unknown", "warn", "fail"};

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
    std::string word = kWords.at(static_cast<std::size_t>(one.verdict)), name = nameOf(one);
    word.resize(kVerdictWidth, ' ');
    name.resize(widest + 2, ' ');
    text.append(word).append(name).append(printable(one.found)).append(1, '\n');
    if (!one.mend.empty()) text.append(kVerdictWidth, ' ').append(printable(one.mend)).append(1, '\n');
  }
  return text;
}

std::string reportJson(const std::vector<Finding>& findings) {
  JsonWriter json;
  json.open('{').key("checks").open('[');
  for (const Finding& one : findings) {
    json.open('{').key("check").string(one.check).key("instance").string(one.instance).key("verdict");
    json.string(kJsonWords.at(static_cast<std::size_t>(one.verdict)));
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
