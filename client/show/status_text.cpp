#include "client/show/status_text.h"

#include "base/printable.h"
#include "client/show/health.h"
#include "client/show/json.h"
#include "client/show/reflection.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <optional>

namespace traction::client {

namespace {

/// Heads in the order in which they are printed; others follow.
constexpr std::array<std::string_view, 9> kHeads = {"rate",    "latency", "frames",    "fields", "camera",
                                                    "markers", "zero",    "real time", "log"};
constexpr std::size_t kHeadWidth = 10;

struct Line {
  std::string head, text;
  int rank = 0;
  bool hasHead = false;  ///< also where the line before has the same
};

/// A field by its path from a message.
struct Place {
  const Reflected* message;
  const FieldDescriptor* field;  ///< null: there is none of this name
};

Place find(const Reflected& from, std::string_view path) {
  const Reflected* message = &from;
  for (;;) {
    const std::size_t dot = path.find('.');
    const FieldDescriptor* field = message->GetDescriptor()->FindFieldByName(std::string(path.substr(0, dot)));
    if (dot == std::string_view::npos || field == nullptr) return {message, field};
    message = &message->GetReflection()->GetMessage(*message, field);
    path.remove_prefix(dot + 1);
  }
}

/// Returns the sum of the fields of a message that belong to a metric.
std::uint64_t sumOf(const Reflected& message, std::string_view metric) {
  std::uint64_t sum = 0;
  for (int i = 0; i < message.GetDescriptor()->field_count(); ++i) {
    const FieldDescriptor& field = *message.GetDescriptor()->field(i);
    if (field.options().GetExtension(v1::metric).name() == metric)
      sum += std::get<std::uint64_t>(scalarOf(message, field));
  }
  return sum;
}

/// One line of the status: its text, and whether a field in it is set.
class Filled {
 public:
  /// \param self name of the field that {} stands for
  Filled(std::string_view line, const Reflected& scope, std::string_view self)
      : scope_(scope)
      , self_(self) {
    for (std::size_t i = 0; i < line.size(); ++i) {
      if (line[i] == '{') {
        const std::size_t end = line.find('}', i);
        put(line.substr(i + 1, end - i - 1));
        i = end;
      } else if (line[i] == '[') {
        bracket_ = text_.size();
        bracketIsSet_ = false;
      } else if (line[i] == ']') {
        if (!bracketIsSet_) text_.resize(*bracket_);
        bracket_.reset();
      } else {
        text_ += line[i];
      }
    }
  }
  const std::string& text() const { return text_; }
  bool isSet() const { return isSet_; }

 private:
  /// \param token name[:pattern[*factor]]
  void put(std::string_view token) {
    const std::size_t colon = std::min(token.find(':'), token.size());
    const std::string_view name = colon == 0 ? self_ : token.substr(0, colon);
    std::string_view pattern = token.substr(std::min(colon + 1, token.size()));
    double factor = 1.0;
    if (const std::size_t star = pattern.find('*'); star != std::string_view::npos) {
      std::from_chars(pattern.data() + star + 1, pattern.data() + pattern.size(), factor);
      pattern = pattern.substr(0, star);
    }
    const auto [message, field] = find(scope_, name);
    if (field == nullptr) {
      text_ += std::to_string(sumOf(scope_, name));
      return;
    }
    text_ += textOf(scalarOf(*message, *field), std::string(pattern), factor);
    (bracket_ ? bracketIsSet_ : isSet_) |= client::isSet(*message, *field);
  }

  const Reflected& scope_;
  std::string_view self_;
  std::string text_;
  std::optional<std::size_t> bracket_;
  bool isSet_ = false, bracketIsSet_ = false;
};

bool isPrinted(const v1::Text& text, const Filled& filled, const Reflected& scope) {
  if (text.always()) return true;
  if (text.when().empty()) return filled.isSet();
  const auto [message, field] = find(scope, text.when());
  return isSet(*message, *field);
}

// NOLINTBEGIN(misc-no-recursion): as deep as the messages of the schema
/// Appends the lines of a message's fields, and of the messages in it.
void collect(const Reflected& message, std::vector<Line>& lines) {
  for (int i = 0; i < message.GetDescriptor()->field_count(); ++i) {
    const FieldDescriptor& field = *message.GetDescriptor()->field(i);
    const v1::Text& text = field.options().GetExtension(v1::text);
    const auto add = [&](const Reflected& scope, int index) {
      if (!field.options().HasExtension(v1::text)) return;
      const Filled filled(text.line(), scope, field.name());
      if (!isPrinted(text, filled, scope)) return;
      if (text.joined() && index > 0) {
        lines.back().text += ", " + filled.text();
      } else {
        lines.push_back({text.head(), filled.text(), text.rank()});
      }
    };
    if (!isMessage(field)) {
      add(message, -1);
      continue;
    }
    forEachMessage(message, field, add);
    forEachMessage(message, field, [&](const Reflected& part, int) { collect(part, lines); });
  }
}
// NOLINTEND(misc-no-recursion)

std::string linesOf(std::vector<Line> lines) {
  const auto place = [](const Line& line) {
    return std::pair(std::find(kHeads.begin(), kHeads.end(), line.head), line.rank);
  };
  std::stable_sort(lines.begin(), lines.end(), [&](const Line& a, const Line& b) { return place(a) < place(b); });
  std::string text, before;
  for (const Line& line : lines) {
    std::string head = line.head == before && !line.hasHead ? "" : line.head;
    head.resize(std::max(kHeadWidth, head.size() + 1), ' ');
    text += head + printable(line.text) + "\n";
    before = line.head;
  }
  return text;
}

}  // namespace

std::string statusText(const Status& status) {
  const v1::Status& message = *status.message;
  std::vector<Line> lines;
  collect(*reflected(message), lines);
  if (const std::string granted = grantedOf(message); granted != "off")
    lines.push_back({"real time", granted, 0, true});
  if (const std::string refused = refusedOf(message); !refused.empty())
    lines.push_back({"real time", "not granted: " + refused + "; the log has what mends it", 0, true});
  return printable(status.header.sensor) + ": " + printable(cameraSentence(message)) + ", up " +
         formatted(message.uptime_s(), "%.0f") + " s, boot " + toHex(status.header.boot) + "\n" +
         linesOf(std::move(lines));
}

std::string grantedOf(const v1::Status& status) {
  const v1::Scheduling& scheduling = status.scheduling();
  std::string text;
  if (!scheduling.threads().empty()) {
    const auto [low, high] = std::minmax_element(
        scheduling.threads().begin(), scheduling.threads().end(),
        [](const v1::ThreadScheduling& a, const v1::ThreadScheduling& b) { return a.priority() < b.priority(); });
    if (high->priority() > 0) text = "priority " + std::to_string(low->priority());
    if (high->priority() > low->priority()) text += " to " + std::to_string(high->priority());
    if (!scheduling.asked_cpus().empty()) text += (text.empty() ? "on " : " on ") + high->cpus();
  }
  if (scheduling.locked_bytes() > 0) text += text.empty() ? "memory locked" : ", memory locked";
  return text.empty() ? "off" : text;
}

}  // namespace traction::client
