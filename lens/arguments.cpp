#include "lens/arguments.h"

#include "manual/number.h"
#include "manual/parse.h"

#include <CLI/CLI.hpp>

#include <cstdio>
#include <iostream>
#include <optional>

namespace lens {
namespace {

constexpr const char* kExitCodes = R"(Exit codes (sysexits.h):
   0  done
  64  the command line is wrong
  65  a picture does not serve: damaged, blurred, of another board or camera, or all too alike
  66  a file cannot be read
  73  a file cannot be created
  78  the gel file is wrong)";

constexpr const char* kCalibrateHelp =
    "Finds focal length, principal point and distortion in pictures of a chessboard, and writes them into a gel file. "
    "Take 15 pictures before the gel is mounted, with the lens focused and locked as it will be used: the board as a "
    "whole in each, tilted by 20 to 45 degrees to each side in turn, now here, now there, up to the picture's corners.";

/// Parses "9x6".
std::optional<std::pair<int, int>> parseSquares(const std::string& text) {
  int columns = 0, rows = 0;
  char more = 0;
  const bool isSize = std::sscanf(text.c_str(), "%dx%d%c", &columns, &rows, &more) == 2;
  if (!isSize || columns < 4 || rows < 4 || columns > 100 || rows > 100) return std::nullopt;
  return std::pair(columns, rows);
}

/// Parses "10" or "10.2x10" [mm].
std::optional<std::pair<double, double>> parseSquare(const std::string& text) {
  const auto isLength = [](double side) { return side >= 0.1 && side <= 1000.0; };
  double across = 0.0, along = 0.0;
  char sign = 'x', more = 0;
  const int read = std::sscanf(text.c_str(), "%lf%c%lf%c", &across, &sign, &along, &more);
  if (read == 1) along = across;
  if ((read != 1 && read != 3) || sign != 'x' || !isLength(across) || !isLength(along)) return std::nullopt;
  return std::pair(across, along);
}

tl::unexpected<int> failed(const std::string& what) {
  std::cerr << "traction-lens: " << what << '\n';
  return tl::unexpected<int>(EX_USAGE);
}

/// What the command line says of `calibrate` and `board`. The options fill it.
struct CalibrateLine {
  CalibrateOptions options;
  std::string squares, square;
  std::string picture;  ///< of `board`

  /// Returns the command; prints why the board is none.
  tl::expected<Command, int> command() {
    const auto size = squaresOf();
    if (!size) return tl::unexpected(size.error());
    const auto sides = parseSquare(square);
    if (!sides) return failed("--square-mm is to be one or two lengths of 0.1 to 1000 mm, such as 10 or 10.2x10");
    options.board = {size->first, size->second, 1e-3 * sides->first, sides->second / sides->first};
    options.boardIsMeasured = square.find('x') != std::string::npos;
    if (size->first == size->second && sides->first != sides->second) {
      return failed("squares that are oblong need a board with more of them along one side than along the other");
    }
    return [made = options](Report& report) { return lens::calibrate(made, report); };
  }

  /// Does the same for the command that looks for the board in `picture`.
  tl::expected<Command, int> boardCommand() const {
    return squaresOf().map([this](const auto& size) -> Command {
      return [file = picture, board = Board{.columns = size.first, .rows = size.second}](Report& report) {
        return findBoard(file, board, report);
      };
    });
  }

 private:
  tl::expected<std::pair<int, int>, int> squaresOf() const {
    const auto size = parseSquares(squares);
    if (!size) return failed("--squares is to be two numbers of 4 or more, such as 9x6; see traction-lens --help");
    return *size;
  }
};

// Each adds a subcommand, whose options must outlive the command line.

void addFile(CLI::App& command, const char* name, std::string& file, const char* help) {
  command.add_option(name, file, help)->type_name("FILE")->required();
}

void addSquares(CLI::App& command, CalibrateLine& line) {
  command.add_option("--squares", line.squares, "of the board along its sides, black and white, as in 9x6")
      ->type_name("COLUMNSxROWS")
      ->required();
}

CLI::App& addCalibrate(CLI::App& app, CalibrateLine& line) {
  auto* calibrate = app.add_subcommand("calibrate", kCalibrateHelp);
  calibrate->add_option("PICTURES", line.options.pictures, "PNG, TIFF or JPEG")->type_name("FILE")->required();
  addSquares(*calibrate, line);
  calibrate
      ->add_option("--square-mm", line.square,
                   "side of a square; or, as ten squares measured along both sides give them, those along the rows and "
                   "along the columns, as in 10.2x10")
      ->type_name("MM[xMM]")
      ->required();
  calibrate->add_option("--gel", line.options.gel, "gel file to write the lens into; without: the paper's sensor")
      ->type_name("FILE");
  calibrate->add_flag(
      "--fisheye", line.options.fisheye,
      "fits a fisheye (k1 to k4, as OpenCV's) instead of a pinhole, for lenses that see more than 100 degrees");
  addFile(*calibrate, "--output", line.options.output, "gel file to be written");
  calibrate->add_flag("--force", line.options.force, "replaces an existing file");
  return *calibrate;
}

CLI::App& addBoard(CLI::App& app, CalibrateLine& line) {
  auto* board = app.add_subcommand("board", "Finds the chessboard in one picture, and tells where and how sharp it is");
  addFile(*board, "PICTURE", line.picture, "PNG, TIFF or JPEG");
  addSquares(*board, line);
  return *board;
}

CLI::App& addPose(CLI::App& app, PoseOptions& options) {
  auto* pose = app.add_subcommand(
      "pose", "Finds where the camera is, from one picture of the untouched gel, however far off the gel file has it");
  addFile(*pose, "PICTURE", options.picture, "PNG, TIFF or JPEG");
  addFile(*pose, "--gel", options.gel, "gel file with the lens and the layers");
  addFile(*pose, "--output", options.output, "gel file to be written");
  pose->add_option("--accept-residual", options.acceptResidual_px,
                   "writes the pose where up to so many pixels are left of the markers' places (rms), with a warning "
                   "above 0.5; without: 0.5")
      ->type_name("PX")
      ->check(manual::number(0.01, 100.0));
  pose->add_flag("--same-lens", options.sameLens,
                 "the gel file's lens was measured on another camera of the same model, and is on this one now");
  pose->add_flag("--force", options.force,
                 "replaces an existing file, and writes the pose although the picture shows other columns, rows or "
                 "layers than the gel file, with a warning");
  return *pose;
}

CLI::App& addMark(CLI::App& app, PictureOptions& options) {
  auto* mark = app.add_subcommand("mark", "Draws the markers that are found in a picture of the untouched gel");
  addFile(*mark, "PICTURE", options.picture, "PNG, TIFF or JPEG");
  addFile(*mark, "--gel", options.gel, "gel file");
  addFile(*mark, "--output", options.output, "PNG to be written");
  return *mark;
}

CLI::App& addSheet(CLI::App& app, SheetsOptions& options) {
  auto* sheet = app.add_subcommand("sheet", "Writes each layer of markers as SVG, to be printed at true scale");
  sheet->add_option("--gel", options.gel, "gel file; without: the paper's sensor")->type_name("FILE");
  sheet->add_option("--output-dir", options.directory, "for layer1.svg, layer2.svg; without: this one")
      ->type_name("DIR");
  sheet->add_flag("--mirrored", options.mirrored, "for a transfer that turns the print over");
  return *sheet;
}

}  // namespace

tl::expected<Request, int> parseArguments(int argc, char** argv) {
  CLI::App app("Calibrates a camera's lens, and helps to make and to mount a gel.", "traction-lens");
  app.set_version_flag("--version", "traction-lens " TRACTION_VERSION);
  app.require_subcommand(0, 1);  // checked below, so that an unknown word is reported first
  app.footer(kExitCodes);

  bool json = false;
  app.add_flag("--json", json,
               "prints one JSON object for programs: figures, notes, and faults, which standard error has, too");
  app.fallthrough();

  CalibrateLine calibration, finding;
  PoseOptions posing;
  PictureOptions marking;
  SheetsOptions sheets;
  const CLI::App& calibrate = addCalibrate(app, calibration);
  const CLI::App& board = addBoard(app, finding);
  const CLI::App& pose = addPose(app, posing);
  const CLI::App& mark = addMark(app, marking);
  const CLI::App& sheet = addSheet(app, sheets);

  if (const auto parsed = manual::parse(app, argc, argv); !parsed) return tl::unexpected(parsed.error());
  const auto request = [json](Command command) { return Request{std::move(command), json}; };
  if (calibrate.parsed()) return calibration.command().map(request);
  if (board.parsed()) return finding.boardCommand().map(request);
  if (pose.parsed()) return request([posing](Report& report) { return lens::pose(posing, report); });
  if (mark.parsed()) return request([marking](Report& report) { return lens::mark(marking, report); });
  if (sheet.parsed()) return request([sheets](Report& report) { return writeSheets(sheets, report); });
  return failed("a command is needed; see traction-lens --help");
}

}  // namespace lens
