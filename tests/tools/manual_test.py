"""Manual pages are without fault for man and mandoc, and two shells complete what --help shows."""

import os
import pathlib
import re
import subprocess
import unittest

from scripts import SOURCE

BUILD = pathlib.Path(os.environ["TRACTION_BUILD"])
MANUAL = BUILD / "manual"
SECTIONS = {"tractiond": 8, "traction-gateway": 8, "traction-touch": 8, "traction-input": 1, "tractionctl": 1, "traction-twin": 1, "traction-lens": 1, "traction-view": 1,
            "traction-gel": 1}
# A machine that npm does not reach cannot build the viewer.
PROGRAMS = [name for name in SECTIONS if name != "traction-view" or (BUILD / "bin" / name).exists()]
PAGES = [f"{name}.{SECTIONS[name]}" for name in PROGRAMS] + ["tractiond.toml.5", "traction-gateway.toml.5"]
ENV = {**os.environ, "PATH": f"{BUILD / 'bin'}:{os.environ['PATH']}", "LC_ALL": "C.UTF-8"}

OPTION = r"  (?:-\w,)?(--[\w-]+)"  # as --help has it


def run(*command, **options):
    return subprocess.run(command, env=ENV, stdin=subprocess.DEVNULL, capture_output=True, text=True, timeout=120,
                          **options)


class Help:
    """What --help of a command prints, read line by line."""

    def __init__(self, *path):
        self.path = path
        self.text = run(BUILD / "bin" / path[0], *path[1:], "--help").stdout
        section, self.options, self.commands = "", [], []
        for line in self.text.splitlines():
            if line.endswith(":") and line[0] != " ":
                section = line
            elif section == "Options:" and (found := re.match(OPTION, line)):
                self.options.append(found[1])
            elif section == "Subcommands:" and (found := re.match(r"  (\w+)", line)):
                self.commands.append(found[1])

    def all(self):
        yield self
        for name in self.commands:
            yield from Help(*self.path, name).all()


class Pages(unittest.TestCase):
    def test_readers_of_manual_pages_find_no_fault(self):
        for name in PAGES:
            with self.subTest(name):
                done = run("mandoc", "-Tlint", name, cwd=MANUAL)
                self.assertEqual((done.returncode, done.stdout), (0, ""))
                done = run("man", "--warnings", "-E", "UTF-8", "-l", "-Tutf8", "-Z", MANUAL / name)
                self.assertEqual((done.returncode, done.stderr), (0, ""))


class Bash:
    name = "bash"

    def complete(self, *words, cwd=SOURCE):
        """What bash's own variables lead to."""
        script = (f"source '{MANUAL / words[0]}'\nCOMP_WORDS=(\"$@\") COMP_CWORD=$(($# - 1))\n"
                  f"function=$(complete -p {words[0]} | sed 's/.*-F \\(\\S*\\) .*/\\1/')\n"
                  "$function \"$1\" \"${@: -1}\" \"${@: -2:1}\"\n"
                  "[ ${#COMPREPLY[@]} = 0 ] || printf '%s\\n' \"${COMPREPLY[@]}\"")
        return said("bash", "--norc", "-c", script, "bash", *words, cwd=cwd)


class Fish:
    name = "fish"

    def complete(self, *words, cwd=SOURCE):
        script = f"source '{MANUAL / words[0]}.fish'\ncomplete -C (string join ' ' -- $argv)"
        lines = said("fish", "--no-config", "-c", script, *words, cwd=cwd)
        return [line.partition("\t")[0].removesuffix("/") for line in lines]


def said(*command, **options):
    done = run(*command, **options)
    assert (done.returncode, done.stderr) == (0, ""), done
    return done.stdout.splitlines()


class Completion(unittest.TestCase):
    def test_offers_what_help_shows(self):
        for shell in (Bash(), Fish()):
            for help in (help for program in PROGRAMS for help in Help(program).all()):
                with self.subTest(shell=shell.name, command=help.path):
                    self.assertLessEqual(set(help.options), set(shell.complete(*help.path, "--")))
                    if help.commands:
                        self.assertEqual(set(shell.complete(*help.path, "")), set(help.commands))

    def test_takes_a_value_for_no_command(self):
        for shell in (Bash(), Fish()):
            with self.subTest(shell.name):
                self.assertIn("status", shell.complete("tractionctl", "--instance", "camera", "st"))
                self.assertEqual(shell.complete("tractionctl", "--server-key", ""), [])
