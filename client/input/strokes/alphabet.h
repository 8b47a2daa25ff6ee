// The strokes of an alphabet, in a TOML file: config/input/strokes/alphabet.toml has those that are shipped, and a
// user's own may be added (traction-input --teach).
#pragma once

#include "base/error.h"
#include "client/input/strokes/recogniser.h"

#include <tl/expected.hpp>

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace traction::input {

/// What a stroke writes: a text, or one of these names.
inline constexpr std::string_view kSpace = "space", kDelete = "delete";
inline constexpr std::string_view kDigits = "digits";    ///< from now on those of the mode "digits"
inline constexpr std::string_view kLetters = "letters";  ///< and back

/// A way to draw a symbol, in a mode.
struct Template {
  std::string mode;  ///< kLetters or kDigits
  std::string symbol;
  Stroke stroke;
};

using Alphabet = std::vector<Template>;

/// Parses the text of a file. EX_CONFIG: it is wrong.
/// \param name of the file in errors
tl::expected<Alphabet, tractiond::Error> parseAlphabet(std::string_view text, const std::string& name);
/// Parses a file. EX_NOINPUT: it cannot be read.
tl::expected<Alphabet, tractiond::Error> loadAlphabet(const std::filesystem::path& path);
/// Returns a file's text of strokes, which may be appended to another file.
std::string textOf(const Alphabet& alphabet);

}  // namespace traction::input
