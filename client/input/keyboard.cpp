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

struct Named {
  std::string_view symbol;
  std::uint16_t key;
};
constexpr std::array kNamed = {
    Named{kSpace, KEY_SPACE}, Named{kDelete, KEY_BACKSPACE}, Named{"enter", KEY_ENTER},       Named{"tab", KEY_TAB},
    Named{"escape", KEY_ESC}, Named{"left", KEY_LEFT},       Named{"right", KEY_RIGHT},       Named{"up", KEY_UP},
    Named{"down", KEY_DOWN},  Named{"page_up", KEY_PAGEUP},  Named{"page_down", KEY_PAGEDOWN}};

}  // namespace

EventDevice::Ability Keyboard::ability() {
  EventDevice::Ability ability{
      .name = "traction-input keyboard", .keys = {}, .relative = {}, .properties = {}, .absolute = {}};
  ability.keys.assign(kKeys.begin(), kKeys.end());
  for (const Named& named : kNamed) ability.keys.push_back(named.key);
  return ability;
}

std::uint16_t Keyboard::keyOf(std::string_view symbol) {
  const auto* const named = std::ranges::find(kNamed, symbol, &Named::symbol);
  if (named != kNamed.end()) return named->key;
  const std::size_t at = symbol.size() == 1 ? kSymbols.find(symbol.front()) : std::string_view::npos;
  return at == std::string_view::npos ? 0 : kKeys.at(at);
}

bool Keyboard::canType(std::string_view symbol) {
  return symbol == kDigits || symbol == kLetters || keyOf(symbol) != 0;
}

void Keyboard::write(const Touches& touches) {
  areSeveral_ = touches.touches.size() > 1 || (areSeveral_ && !touches.touches.empty());
  const bool isLost = touches.touches.empty() && !touches.valid;
  if (areSeveral_ || isLost) {
    reader_.cancel();
    presses_.cancel();
    id_ = 0;
    return;
  }
  if (touches.touches.empty() || touches.touches.front().id != id_) {
    end();
    id_ = touches.touches.empty() ? 0 : touches.touches.front().id;
  }
  if (id_ == 0 || !touches.touches.front().seen) return;
  const Touch& touch = touches.touches.front();
  if (const auto turn = presses_.move(touch, touches.time_ns)) type(*turn);
  const auto [x, y] = touch.position_m;
  reader_.move({1e3 * x, 1e3 * y});
  if (presses_.hasTurned()) reader_.cancel();
}

void Keyboard::end() {
  using Kind = Reading::Kind;
  const auto press = presses_.end();
  const auto reading = reader_.end();
  if (!reading) return;
  if (reading->kind == Kind::kTap && press) type(*press);
  if (reading->kind == Kind::kSymbol) type(reading->symbol);
  if (reading->kind == Kind::kDoubtful) spdlog::info("a stroke is in doubt, and types nothing: draw it again");
  if (reading->kind == Kind::kMode) spdlog::info("strokes are {} now", reading->symbol);
}

void Keyboard::type(std::string_view symbol) {
  const std::uint16_t key = keyOf(symbol);
  if (key == 0) return;
  for (const int value : {1, 0}) {
    device_.add(EV_KEY, key, value);
    device_.report();
  }
}

}  // namespace traction::input
