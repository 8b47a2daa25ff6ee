#include "lens/report.h"

#include "base/json_writer.h"

#include <cstdarg>
#include <cstdio>

namespace lens {

namespace {

std::string format(const char* pattern, std::va_list values) {
  std::va_list again;
  va_copy(again, values);
  std::string text(static_cast<std::size_t>(std::vsnprintf(nullptr, 0, pattern, again)), '\0');
  va_end(again);
  std::vsnprintf(text.data(), text.size() + 1, pattern, values);
  return text;
}

}  // namespace

// NOLINTBEGIN(cert-dcl50-cpp): the compiler checks the arguments against the patterns
void Report::line(const char* pattern, ...) {
  std::va_list values;
  va_start(values, pattern);
  text_ += format(pattern, values) + "\n";
  va_end(values);
}

void Report::item(const char* pattern, ...) {
  std::va_list values;
  va_start(values, pattern);
  notes_.push_back(format(pattern, values));
  va_end(values);
  text_ += "  " + notes_.back() + "\n";
}

void Report::note(const char* pattern, ...) {
  std::va_list values;
  va_start(values, pattern);
  notes_.push_back(format(pattern, values));
  va_end(values);
  text_ += "  note: " + notes_.back() + "\n";
}

void Report::warning(const char* pattern, ...) {
  std::va_list values;
  va_start(values, pattern);
  notes_.push_back("warning: " + format(pattern, values));
  va_end(values);
  text_ += "  " + notes_.back() + "\n";
}
// NOLINTEND(cert-dcl50-cpp)

void Report::figure(const std::string& name, double value, double deviation, const char* unit) {
  figures_.push_back({name, value, deviation, unit});
  if (deviation < 0.0) return line("  %-16s %12.7g %s", name.c_str(), value, unit);
  line("  %-16s %12.7g +- %-8.2g %s", name.c_str(), value, deviation, unit);
}

std::string Report::json(const Faults& faults) const {
  traction::JsonWriter json;
  json.open('{').key("figures").open('[');
  for (const Figure& figure : figures_) {
    json.open('{').key("name").string(figure.name).key("value").number(figure.value);
    if (figure.deviation >= 0.0) json.key("deviation").number(figure.deviation);
    json.key("unit").string(figure.unit).close('}');
  }
  json.close(']').key("notes").strings(notes_).key("faults").open('[');
  for (const tractiond::Error& fault : faults) json.string(fault.message());
  return json.close(']').close('}').take();
}

}  // namespace lens
