#include "client/input/keyboard.h"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <array>
#include <cstddef>

namespace traction::input {
namespace {

/// Letters and digits, and the keys that type them.
constexpr std::string_view kSymbols = "abcdefghijklmnopqrstuvwxyz0123456789";
constexpr std::array<std::uint16_t, kSymbols.size()> kKeys = {
    KEY_A, KEY_B, KEY_C, KEY_D, KEY_E, KEY_F, KEY_G, KEY_H, KEY_I, KEY_J, KEY_K, KEY_L,
    KEY_M, KEY_N, KEY_O, KEY_P, KEY_Q, KEY_R, KEY_S, KEY_T, KEY_U, KEY_V, KEY_W, KEY_X,
    KEY_Y, KEY_Z, KEY_0, KEY_1, KEY_2, KEY_3, KEY_4, KEY_5, KEY_6, KEY_7, KEY_8, KEY_9};

/// Returns the key that types a symbol; 0: there is none.
std::uint16_t keyOf(std::string_view symbol) {
  if (symbol == kSpace) return KEY_SPACE;
  if (symbol == kDelete) return KEY_BACKSPACE;
  const std::size_t at = symbol.size() == 1 ? kSymbols.find(symbol.front()) : std::string_view::npos;
  return at == std::string_view::npos ? 0 : kKeys.at(at);
}

}  // namespace

EventDevice::Ability Keyboard::ability() {
  EventDevice::Ability ability{.name = "traction-input keyboard",
                               .keys = {KEY_SPACE, KEY_BACKSPACE},
                               .relative = {},
                               .properties = {},
                               .absolute = {}};
  ability.keys.insert(ability.keys.end(), kKeys.begin(), kKeys.end());
  return ability;
}

bool Keyboard::canType(std::string_view symbol) {
  return symbol == kDigits || symbol == kLetters || keyOf(symbol) != 0;
}

void Keyboard::write(const Touches& touches) {
  areSeveral_ = touches.touches.size() > 1 || (areSeveral_ && !touches.touches.empty());
  const bool isLost = touches.touches.empty() && !touches.valid;
  if (areSeveral_ || isLost) {
    reader_.cancel();
    id_ = 0;
    return;
  }
  if (touches.touches.empty() || touches.touches.front().id != id_) {
    if (const auto reading = reader_.end()) type(*reading);
    id_ = touches.touches.empty() ? 0 : touches.touches.front().id;
  }
  if (id_ == 0 || !touches.touches.front().seen) return;
  const auto [x, y] = touches.touches.front().position_m;
  reader_.move({1e3 * x, 1e3 * y});
}

void Keyboard::type(const Reading& reading) {
  if (reading.kind == Reading::Kind::kDoubtful) spdlog::info("a stroke is in doubt, and types nothing: draw it again");
  if (reading.kind == Reading::Kind::kMode) spdlog::info("strokes are {} now", reading.symbol);
  if (reading.kind != Reading::Kind::kSymbol) return;
  for (const int value : {1, 0}) {
    device_.add(EV_KEY, keyOf(reading.symbol), value);
    device_.report();
  }
}

}  // namespace traction::input
