"""Options and commands of traction-gel as a table, of which parser, --help, manual page and completions are made."""

import argparse
import json
import sys

NAME = "traction-gel"
WHAT = "Makes the influence file and the gel file of a gel of any shape, for tractiond, and draws what it is cast in."
EXITS = {
    0: "done",
    64: "the command line is wrong",
    65: "the description is wrong, asks for an error that cannot be reached, or --check finds a larger one or no CalculiX",
    66: "the description cannot be read",
    70: "something unexpected failed, in a library for example; the message says what and where",
    73: "a file cannot be created",
    130: "interrupted; nothing was written",
}
# name (none: an operand), operand or value, help
HELP = ("-h,--help", "", "Print this help message and exit")
OPTIONS = [HELP, ("--version", "", "Display program version information and exit")]
COMMANDS = {
    "mesh": (
        "Compute influence file, gel file and a picture from a description",
        [
            HELP,
            ("", "DESCRIPTION", "TOML file: shape, material, markers and nodes"),
            ("--check", "", "Have CalculiX (ccx) compute a few loads anew, and fail beyond error_percent"),
            ("--output", "NAME", "Write NAME.npz, NAME_gel.toml, NAME.png; without it named as DESCRIPTION, in this folder"),
        ],
    ),
    "mould": (
        "Draw bone, cups and lid to cast a built-in shape in, as STEP and STL",
        [
            HELP,
            ("", "DESCRIPTION", "TOML file, of which shape, skins and depths of markers count, and [mould]"),
            ("--output", "NAME", "Write NAME_bone.step, ..., NAME_mould.png; without it named as DESCRIPTION, in this folder"),
        ],
    ),
}


def _footer():
    return "Exit codes (sysexits.h):\n" + "".join(f"{code:4}  {text}\n" for code, text in EXITS.items())


def help_text(command=None):
    """Returns what --help prints, of the program or of a command."""
    what, options = COMMANDS[command] if command else (WHAT, OPTIONS)
    operands = [(operand, text) for name, operand, text in options if not name]
    usage = " ".join([NAME, *([command] if command else []), "[OPTIONS]", *(name for name, _ in operands)])
    sections = {"Positionals": operands, "Options": [(f"{name} {value}", text) for name, value, text in options if name]}
    if not command:
        usage += " SUBCOMMAND"
        sections["Subcommands"] = [(name, text) for name, (text, _) in COMMANDS.items()]
    text = f"{what}\nUsage: {usage}\n"
    for head, rows in sections.items():
        if rows:
            text += f"\n{head}:\n" + "".join(f"  {first:<28}{second}\n" for first, second in rows)
    return text if command else f"{text}\n{_footer()}"


def description():
    """Returns the command line as JSON, as the other programs describe theirs (manual/describe.h)."""

    def entry(name, what, footer, options, commands):
        listed = [
            {"names": names.split(",") if names else [], "operand": "" if names else value, "value": value if names else "",
             "default": "", "required": not names, "many": False, "excludes": [], "help": text}
            for names, value, text in options
        ]  # fmt: skip
        return {"name": name, "help": what, "footer": footer, "inherits": False, "options": listed, "commands": commands}

    commands = [entry(name, what, "", options, []) for name, (what, options) in COMMANDS.items()]
    return json.dumps(entry(NAME, WHAT, _footer(), OPTIONS, commands))


class _Parser(argparse.ArgumentParser):
    def __init__(self, *arguments, command=None, **options):
        super().__init__(*arguments, add_help=False, allow_abbrev=False, **options)
        self.command = command
        self.add_argument("-h", "--help", action="help")

    def format_help(self):
        return help_text(self.command)

    def error(self, message):
        print(f"{NAME}: {message}; see {NAME} --help", file=sys.stderr)
        raise SystemExit(64)


def parse(arguments, version):
    """Returns the options; ends the program after --help, --version, or a wrong command line (64)."""
    if (sys.argv[1:] if arguments is None else arguments) == ["--describe-command-line"]:
        print(description())
        raise SystemExit(0)
    parser = _Parser(prog=NAME)
    parser.add_argument("--version", action="version", version=f"{NAME} {version}")
    commands = parser.add_subparsers(dest="command", required=True, metavar="SUBCOMMAND")
    for name, (_, options) in COMMANDS.items():
        command = commands.add_parser(name, command=name)
        for names, value, _ in options[1:]:
            command.add_argument(names or value.lower(), **({} if value else {"action": "store_true"}))
    return parser.parse_args(arguments)
