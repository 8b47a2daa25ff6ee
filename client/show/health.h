// Decides what is wrong with an instrument, a tractiond with its camera and gel, by its status and its fields: for
// status, metrics, doctor, watch, top and the viewer's page alike.
#pragma once

#include "client/show/scene.h"

#include <string>
#include <vector>

namespace traction::client {

/// How well an instrument measures, best first.
enum class Health {
  kMeasuring,  ///< nothing is wrong
  kDoubtful,   ///< forces are published as valid; something is wrong that may concern them
  kNoForces,   ///< fields are published, without valid forces
  kNoFields,   ///< no fields are published
};

/// Returns "measuring", "doubtful", "no_forces" or "no_fields".
const char* nameOf(Health health);

/// Something that is wrong, or worth a note.
struct Problem {
  Health health = Health::kDoubtful;  ///< at best, as long as this is so; kMeasuring: worth a note, and not wrong
  std::string what;                   ///< printable: "the camera is lost, no field for 12.3 s"
};

/// Returns a problem as a text of its own: "no valid forces: too few markers are seen".
std::string sentence(const Problem& problem);

/// Returns everything that a status says is wrong, most important first; empty: nothing. kNoFields: whyNoField(), or no
/// frames or no fields since the status before. kNoForces: fields are not valid. kDoubtful: the remark on the markers,
/// and refusedOf().
std::vector<Problem> problems(const v1::Status& status);

/// Returns everything that is wrong now, most important first, by the messages that have come; empty: nothing.
/// kNoFields: Scene::trouble(). kNoForces: the newest field is not valid. kDoubtful: a restart of the daemon in the
/// last 10 s, recent flags, and what is doubtful in the last status. kMeasuring: the zero is not verified, as after
/// each first start. \param now_ns CLOCK_MONOTONIC
std::vector<Problem> problems(const Scene& scene, std::int64_t now_ns);

/// Returns the health of an instrument with these problems: the worst of theirs, kMeasuring if there are none.
Health healthOf(const std::vector<Problem>& problems);

/// Returns whether the daemon runs without a gel file, and therefore publishes no field.
bool isWithoutGel(const v1::Status& status);

// The texts below hold words of the camera or the configuration as they are: what is printed needs printable().

/// Returns the state of the camera, with the reason: "camera lost, being looked for (it does not answer)".
std::string cameraSentence(const v1::Status& status);

/// Returns why the daemon cannot publish fields: its camera does not stream or repeats one picture, or there is no gel
/// file; empty: it can.
std::string whyNoField(const v1::Status& status);
/// Returns that an open camera sends no frames, or none that are new, with the reason; empty: it sends, or is not open.
std::string whyNoPicture(const v1::Status& status);

/// Returns what was configured for real time and not granted: "priority 20, processors 2-3, memory"; empty: nothing.
std::string refusedOf(const v1::Status& status);

}  // namespace traction::client
