// The contacts of a recording.
#pragma once

#include <string>

namespace traction::cli {

/// Writes as CSV the contacts that traction-touch makes of the fields of a recording, whether or not it ran then: a line
/// for each contact of each field. Replaces `to`, and prints nothing. \param sensor empty: all \throws RecordingError
/// EX_USAGE if `to` does not end with .csv, else as exportFields()
void exportContacts(const std::string& from, const std::string& to, const std::string& sensor);

}  // namespace traction::cli
