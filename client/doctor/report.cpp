#include "client/cli/canvas.h"
#include "client/doctor/checks.h"

#include <algorithm>
#include <cstdio>

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

std::string jsonText(const std::string& text) {
  std::string result = "\"";
  for (const char letter : cli::printable(text)) {
    if (letter == '"' || letter == '\\') result += '\\';
    result += letter;
  }
  return result + '"';
}

}  // namespace

std::string reportText(const std::vector<Finding>& findings) {
  const auto nameOf = [](const Finding& one) {
    return one.instance.empty() ? one.check : one.instance + ": " + one.check;
  };
  std::size_t widest = 0;
  for (const Finding& one : findings) widest = std::max(widest, nameOf(one).size());
  std::string text;
  for (const Finding& one : findings) {
    const std::string word = wordOf(one.verdict), name = nameOf(one);
    text += word + std::string(6 - word.size(), ' ') + name + std::string(widest + 2 - name.size(), ' ') +
            cli::printable(one.found) + "\n";
    if (!one.mend.empty()) text += std::string(6, ' ') + cli::printable(one.mend) + "\n";
  }
  return text;
}

std::string reportJson(const std::vector<Finding>& findings) {
  std::string text = R"({"checks":[)";
  for (const Finding& one : findings) {
    std::string word = one.verdict == Verdict::kUnknown ? "unknown" : wordOf(one.verdict);
    std::transform(word.begin(), word.end(), word.begin(), [](unsigned char c) { return std::tolower(c); });
    text += (text.back() == '[' ? "" : ",") + (R"({"check":)" + jsonText(one.check)) + R"(,"instance":)" +
            jsonText(one.instance) + R"(,"verdict":)" + jsonText(word) + R"(,"found":)" + jsonText(one.found) +
            R"(,"mend":)" + jsonText(one.mend) + "}";
  }
  return text + R"(],"exit_code":)" + std::to_string(exitCodeOf(findings)) + "}";
}

int exitCodeOf(const std::vector<Finding>& findings) {
  const auto has = [&](Verdict verdict) {
    return std::any_of(findings.begin(), findings.end(), [&](const Finding& one) { return one.verdict == verdict; });
  };
  return has(Verdict::kFail) ? 2 : has(Verdict::kWarn) ? 1 : 0;
}

}  // namespace traction::doctor
