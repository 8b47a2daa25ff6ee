// The account of every frame: received = published + each named loss + in flight.
#pragma once

#include "daemon/records/ledger_counters.h"

namespace tractiond {

/// One counter for each field of message Ledger in proto/traction/v1/status.proto, where its meaning is written: the
/// build makes the struct from there (cmake/ledger.cmake). A new cause of loss is written there, and where it is
/// counted. `noRestPose` counts the frames for which track::Tracker::track() returns kNoRestPose: those before a first
/// zero is in force. Each counter is written by one thread: the stage's at which a frame leaves the path;
/// discardedAtStop after the threads have been joined.
using Ledger = LedgerCounters;

}  // namespace tractiond
