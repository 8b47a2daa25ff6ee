"""A program's options and commands, as it describes them itself (describe.h)."""

import dataclasses
import json
import re


@dataclasses.dataclass
class Option:
    names: list[str]  # empty: an operand
    value: str        # what stands for it: FILE; empty: a flag
    kind: str         # of the value: FILE, DIR, INSTANCE, SCENARIO; others are not known
    choices: list[str]
    limits: str       # "0 to 1"
    default: str
    required: bool
    many: bool
    excludes: list[str]
    help: str


@dataclasses.dataclass
class Command:
    path: list[str]  # ["tractionctl", "camera", "set"]
    help: str
    footer: str      # its own
    exits: list[tuple[str, str]]
    options: list[Option]
    operands: list[Option]
    inherited: list[Option]  # options of the commands above that it takes, too
    commands: list["Command"]

    def all(self):
        yield self
        for command in self.commands:
            yield from command.all()

    @property
    def name(self):
        return " ".join(self.path)

    @property
    def known(self):
        """All options that it takes."""
        return [*self.options, *self.inherited]


def with_values(program):
    """Names of options that a word follows."""
    return sorted({name for command in program.all() for one in command.options if one.value for name in one.names})


def option(entry):
    kind, _, check = entry["value"].partition(":")
    choices = re.fullmatch(r"\{(.*)\}", check)
    limits = re.fullmatch(r"\w+ in \[(.*) - (.*)\]", check)
    return Option(names=entry["names"], value=entry["operand"] or kind, kind=kind or entry["operand"],
                  choices=re.split(r", *", choices[1]) if choices else [],
                  limits=f"{float(limits[1]):,.10g} to {float(limits[2]):,.10g}" if limits else "",
                  default=entry["default"].strip('"'), required=entry["required"], many=entry["many"],
                  excludes=entry["excludes"], help=entry["help"])


def command(entry, above=(), footer_above="", inherited=()):
    path = [*above, entry["name"]]
    footer, _, codes = ("" if entry["footer"] == footer_above else entry["footer"]).partition("Exit codes")
    everything = [option(one) for one in entry["options"]]
    options = [one for one in everything if one.names]
    names = {name for one in options for name in one.names}
    inherited = [one for one in inherited if not names & set(one.names)]
    passed_on = [one for one in (*options, *inherited) if entry["inherits"] and "--help" not in one.names
                 and "--version" not in one.names]
    return Command(path=path, help=entry["help"], footer=footer.strip(),
                   exits=re.findall(r"^ *(\d+)  (.*)$", codes, re.M),
                   options=options, operands=[one for one in everything if not one.names], inherited=inherited,
                   commands=[command(one, path, entry["footer"], passed_on) for one in entry["commands"]])


def load(file):
    return command(json.loads(file.read_text()))
