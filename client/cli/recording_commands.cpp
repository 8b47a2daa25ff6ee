#include "client/cli/recording_commands.h"

#include "client/cli/parsing.h"
#include "client/cli/recordings.h"

namespace traction::cli {

RecordingCommands::RecordingCommands(CLI::App& app)
    : record_(*app.add_subcommand("record", "Records all that is published into a new file, as MCAP"))
    , replay_(*app.add_subcommand("replay", "Publishes a recording again, in its own time, for any subscriber"))
    , info_(*app.add_subcommand("info", "Tells what is in a recording, and whether all of it is there"))
    , recover_(*app.add_subcommand("recover", "Makes a whole recording of one that was cut off or is damaged"))
    , export_(*app.add_subcommand(
          "export", "Writes the fields of a recording as CSV or as NumPy's arrays, or what Foxglove draws of them")) {
  record_.add_option("file", file_, "to write; an old one is not replaced")->type_name("FILE")->required();
  record_.add_option("--seconds", seconds_, "to record; without: until Ctrl-C")
      ->type_name("SECONDS")
      ->check(number(0.0, "a time of 0 s or more, as in 2.5"));
  record_.add_flag("--pictures", pictures_,
                   "with the camera's pictures, as often and as wide as the daemon's publish.preview_hz and "
                   "publish.preview_width_px say");
  record_.add_option("--truth", truth_, "at which a traction-twin tells what is true (its --truth-endpoint)")
      ->type_name("ENDPOINT");
  replay_.add_option("--bind", endpoint_, "ZeroMQ endpoint to publish at; tractionctl watch --connect to it, say")
      ->type_name("ENDPOINT")
      ->capture_default_str();
  replay_.add_option("--speed", speed_, "times as fast as it was")
      ->type_name("FACTOR")
      ->capture_default_str()
      ->check(number(1e-3, "a factor of 0.001 or more, as in 0.5"));
  for (CLI::App* one : {&replay_, &info_, &recover_, &export_}) {
    one->add_option("file", file_, "the recording")->type_name("FILE")->required();
  }
  info_.add_flag("--json", json_, "as JSON");
  recover_.add_option("output", output_, "to write; an old one is not replaced")->type_name("FILE")->required();
  export_.add_option("output", output_, "to write, .csv, .npz or .mcap; an old one is replaced")
      ->type_name("FILE")
      ->required();
  export_.add_option("--sensor", sensor_, "whose fields, where there are several sensors'")->type_name("NAME");
}

void RecordingCommands::run(const SubscriberOptions& subscription) const {
  if (record_.parsed()) {
    SubscriberOptions all = subscription;
    if (pictures_) all.topics |= kPreview;
    record(all, file_, truth_, seconds_);
  }
  if (replay_.parsed()) replay(file_, endpoint_, speed_);
  if (info_.parsed()) info(file_, json_);
  if (recover_.parsed()) recover(file_, output_);
  if (export_.parsed()) exportFields(file_, output_, sensor_);
}

}  // namespace traction::cli
