// tractionctl record, replay, info, recover, export: commands on recordings. docs/recordings.md describes the format.
#pragma once

#include "traction/subscriber.h"

#include <string>

namespace traction::client {

// All functions below throw Failure: EX_NOINPUT if a recording cannot be read, EX_DATAERR if it is none or is
// damaged, EX_PROTOCOL if it is of a newer version; EX_CANTCREAT if a file cannot be created; EX_IOERR if the disk
// fails. They block until they are done, and throw OutputError if standard output cannot be written. A file that is
// created must not exist yet (EX_CANTCREAT), except where the comment says that it is replaced. What record() and
// replay() print last may remain in the buffer of stdio until flushOutput().

/// Records every message of `options.topics` into a new file until SIGINT, SIGTERM or SIGHUP, whose handlers it sets,
/// or until the time is over, and prints a summary. Reports on standard error what Notes reports. After an error the
/// recording is closed with what came before, or deleted if nothing came.
/// \param options whose queue is ignored
/// \param seconds duration; infinity: no limit
/// \throws Error kNoAnswer if no publisher is found in the first 3 s, or none is connected at the end and no message
/// came, and those of Subscriber
void record(const SubscriberOptions& options, const std::string& file, double seconds);

/// Publishes the recorded stream (topics "traction/...") at `endpoint`, at `speed` times its own rate; prints where,
/// and starts when a client subscribes. Returns after the last message, or early on SIGINT, SIGTERM or SIGHUP, whose
/// handlers it sets, and prints how many messages were sent.
/// \param speed larger than 0
/// \throws Error kBadEndpoint; Failure also after sending, if the recording is cut off or damaged
void replay(const std::string& file, const std::string& endpoint, double speed);

/// Reads the whole recording and prints a summary, as text or as one line of JSON: size, duration, and for each topic
/// messages, rate and losses, without those of a second source that has the name of another one, which it names.
/// \throws Failure also after printing, if it is cut off or damaged
void info(const std::string& file, bool json);

/// Writes a new recording of all intact chunks, and prints how many were copied and what was left out. That `from` is
/// cut off or damaged is no error. If reading or writing fails, the new file is deleted.
/// \throws Failure also EX_DATAERR if no message can be read; nothing is written then
void recover(const std::string& from, const std::string& to);

/// Exports the fields of one sensor as CSV, or all as illustrate() does, by the file extension of `to`: .csv or .mcap;
/// replaces `to`, and prints nothing.
/// \param sensor empty: the only one; for .mcap all
/// \throws Failure also EX_USAGE for another extension, or if a sensor must be named; EX_DATAERR if there are no fields
/// of the sensor; also after writing, if the recording is cut off or damaged or messages were left out that cannot be
/// decoded
void exportFields(const std::string& from, const std::string& to, const std::string& sensor);

/// Writes a recording of all messages and of their drawings for Foxglove; replaces `to`, and prints nothing.
/// \param sensor whose drawings are added; empty: all
/// \throws Failure also EX_USAGE if `to` is `from`, EX_DATAERR if there is nothing to draw; also after writing, if the
/// recording is cut off or damaged, or messages of it could not be drawn because they cannot be decoded
void illustrate(const std::string& from, const std::string& to, const std::string& sensor);

/// Writes as CSV the contacts that traction-touch makes of the fields of a recording, whether or not it ran then: a
/// line for each contact of each field. Replaces `to`, and prints nothing.
/// \param sensor empty: all
/// \throws Failure EX_USAGE if `to` does not end with .csv, else as exportFields()
void exportContacts(const std::string& from, const std::string& to, const std::string& sensor);

}  // namespace traction::client
