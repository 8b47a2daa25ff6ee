#include "client/viewer/health_feed.h"

#include "base/json_writer.h"
#include "client/show/health.h"

namespace traction::view {

void HealthFeed::take(const Message& message) {
  if ((kindOf(message) & (unsigned{kField} | kDescription | kStatus)) != 0) scene_.add(message);
}

void HealthFeed::turn(bool isConnected, std::int64_t now_ns) {
  constexpr std::int64_t kPause_ns = 250'000'000;
  scene_.setConnected(isConnected, now_ns);
  if (now_ns - toldAt_ns_ < kPause_ns) return;
  const std::vector<client::Problem> problems = client::problems(scene_, now_ns);
  JsonWriter json;
  json.open('{').key("health").string(client::nameOf(client::healthOf(problems))).key("problems").open('[');
  for (const client::Problem& one : problems) json.string(one.what);
  std::string text = json.close(']').close('}').take();
  if (text == sent_) return;
  sent_ = std::move(text);
  toldAt_ns_ = now_ns;
  deliver_(kHealth, makeFrame("view/health", sent_));
}

}  // namespace traction::view
