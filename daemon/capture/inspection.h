// A camera's description, evaluated where a crash costs nothing, before this process opens the camera.
#pragma once

#include "daemon/capture/child.h"

#include <string>
#include <string_view>

namespace tractiond::capture {

struct Inspection {
  enum class Outcome { kHarmless, kFault, kAbsent };
  Outcome outcome = Outcome::kFault;
  std::string
      text;  ///< kHarmless: hashOf() the description. kFault: the fault, a sentence. kAbsent: why it does not open
};

/// In the child: opens the camera, evaluates its description and all its features without the camera, and prints what
/// came of that. \param id as Aravis takes it; empty: the first. \return an exit code
int printInspection(const std::string& id);

/// Has it done by a child. Any thread; blocks until the child has ended, or a stop was asked for.
Inspection inspectApart(const std::string& id, const ChildOptions& options, const std::stop_token& stop = {});

/// What the child prints, and from any bytes what is meant by them: a child may have been taken over.
std::string encodeInspection(const Inspection& inspection);
Inspection decodeInspection(std::string_view bytes);

/// Of a description's text.
std::string hashOf(std::string_view xml);

}  // namespace tractiond::capture
