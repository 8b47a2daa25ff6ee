// record, replay, info, recover and export.

#include "client/cli/recordings.h"

#include "client/cli/commands.h"
#include "client/tractionctl/commands.h"
#include "client/tractionctl/contacts.h"
#include "client/tractionctl/parsing.h"
#include "manual/number.h"

#include <sysexits.h>

#include <memory>

namespace traction::cli {

namespace {

struct RecordingLine {
  double seconds = kForever, speed = 1.0;
  std::string file, output, sensor, truth, endpoint = "tcp://127.0.0.1:9892";
  bool json = false, pictures = false, contacts = false;
};

}  // namespace

void addRecordings(Commands& commands) {
  const auto options = std::make_shared<RecordingLine>();
  CLI::App& recording =
      commands.add("record", "Records all published messages, and those of traction-touch, into a new MCAP file",
                   [options](const Target& target) {
                     SubscriberOptions all = target.subscription();
                     all.topics |= kContacts;
                     if (options->pictures) all.topics |= kPreview;
                     return record(all, options->file, options->truth, options->seconds), EX_OK;
                   });
  CLI::App& replaying = commands.add(
      "replay", "Publishes a recording again, in its own time, for all subscribers",
      [options](const Target&) { return replay(options->file, options->endpoint, options->speed), EX_OK; });
  CLI::App& informing = commands.add("info", "Prints the contents of a recording, and whether it is complete",
                                     [options](const Target&) { return info(options->file, options->json), EX_OK; });
  CLI::App& recovering =
      commands.add("recover", "Makes a complete recording from one that was cut off or is damaged",
                   [options](const Target&) { return recover(options->file, options->output), EX_OK; });
  CLI::App& exporting =
      commands.add("export", "Writes the fields of a recording as CSV or NumPy arrays, or as drawings for Foxglove",
                   [options](const Target&) {
                     const auto write = options->contacts ? exportContacts : exportFields;
                     return write(options->file, options->output, options->sensor), EX_OK;
                   });

  recording.add_option("file", options->file, "file to write; an existing one is not replaced")
      ->type_name("FILE")
      ->required();
  recording.add_option("--seconds", options->seconds, "duration; without it: until Ctrl-C")
      ->type_name("SECONDS")
      ->check(timeSpan());
  recording.add_flag("--pictures", options->pictures,
                     "records the camera's pictures, too, at the rate and width of the daemon's publish.preview_hz and "
                     "publish.preview_width_px");
  recording
      .add_option("--truth", options->truth,
                  "endpoint at which a traction-twin publishes the truth (its --truth-endpoint)")
      ->type_name("ENDPOINT");
  replaying
      .add_option("--bind", options->endpoint,
                  "ZeroMQ endpoint to publish at, for example for tractionctl watch --connect")
      ->type_name("ENDPOINT")
      ->capture_default_str();
  replaying.add_option("--speed", options->speed, "factor by which it is faster than the original")
      ->type_name("FACTOR")
      ->capture_default_str()
      ->check(manual::number(1e-3, 1e6, "a factor from 0.001 to 1e6, as in 0.5"));
  for (CLI::App* one : {&replaying, &informing, &recovering, &exporting})
    one->add_option("file", options->file, "recording")->type_name("FILE")->required();
  informing.add_flag("--json", options->json, "as JSON");
  recovering.add_option("output", options->output, "file to write; an existing one is not replaced")
      ->type_name("FILE")
      ->required();
  exporting.add_option("output", options->output, "file to write: .csv, .npz or .mcap; an existing one is replaced")
      ->type_name("FILE")
      ->required();
  exporting.add_flag("--contacts", options->contacts,
                     "as CSV, the contacts that traction-touch makes of the fields, with ids; whether or not it ran");
  exporting.add_option("--sensor", options->sensor, "sensor whose fields are written, if the recording has several")
      ->type_name("NAME");
}

}  // namespace traction::cli
