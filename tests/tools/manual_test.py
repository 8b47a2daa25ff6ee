"""Manual pages and completions hold what --help and --print-config print, and man, mandoc and two shells take them."""

import os
import pathlib
import re
import subprocess
import tempfile
import tomllib
import unittest

from scripts import SOURCE

BUILD = pathlib.Path(os.environ["TRACTION_BUILD"])
MANUAL = BUILD / "manual"
SECTIONS = {"tractiond": 8, "traction-gateway": 8, "traction-touch": 8, "traction-input": 1, "tractionctl": 1, "traction-twin": 1, "traction-lens": 1, "traction-view": 1,
            "traction-gel": 1}
# A machine that npm does not reach cannot build the viewer.
PROGRAMS = [name for name in SECTIONS if name != "traction-view" or (BUILD / "bin" / name).exists()]
CONFIGURATIONS = {"tractiond.toml": "tractiond", "traction-gateway.toml": "traction-gateway"}
PAGES = [f"{name}.{SECTIONS[name]}" for name in PROGRAMS] + [f"{name}.5" for name in CONFIGURATIONS]
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
        section, self.options, self.commands, self.exits = "", [], [], []
        for line in self.text.splitlines():
            if line.endswith(":") and line[0] != " ":
                section = line
            elif section == "Options:" and (found := re.match(OPTION, line)):
                self.options.append(found[1])
            elif section == "Subcommands:" and (found := re.match(r"  (\w+)", line)):
                self.commands.append(found[1])
            elif section.startswith("Exit codes") and (found := re.match(r" +(\d+)  ", line)):
                self.exits.append(found[1])

    def all(self):
        yield self
        for name in self.commands:
            yield from Help(*self.path, name).all()


class Pages(unittest.TestCase):
    def plain(self, name):
        """Without overstriking."""
        text = run("mandoc", "-Tutf8", "-Owidth=200", MANUAL / name, check=True).stdout
        return re.sub(".\b", "", text)

    def test_readers_of_manual_pages_find_no_fault(self):
        for name in PAGES:
            with self.subTest(name):
                done = run("mandoc", "-Tlint", name, cwd=MANUAL)
                self.assertEqual((done.returncode, done.stdout), (0, ""))
                done = run("man", "--warnings", "-E", "UTF-8", "-l", "-Tutf8", "-Z", MANUAL / name)
                self.assertEqual((done.returncode, done.stderr), (0, ""))

    def test_every_option_command_and_exit_code_is_there(self):
        for program in PROGRAMS:
            text = self.plain(f"{program}.{SECTIONS[program]}")
            parts = dict(zip(*[iter(re.split(r"^ {0,3}(\S.*)$", text, flags=re.M)[1:])] * 2))
            for help in Help(program).all():
                with self.subTest(" ".join(help.path)):
                    part = parts[" ".join(help.path[1:]) or "DESCRIPTION"]
                    for option in set(help.options) - ({"--help"} if help.path[1:] else set()):
                        self.assertRegex(part, rf"(?m)^ +(-\w, )?{option}(?= |$)")
                    for code in help.exits if not help.path[1:] else []:
                        self.assertRegex(parts["EXIT STATUS"], rf"(?m)^ +{code} ")

    def test_every_key_is_there_with_its_default(self):
        for name, program in CONFIGURATIONS.items():
            text = self.plain(f"{name}.5")
            with tempfile.NamedTemporaryFile(suffix=".toml") as empty:
                printed = run(BUILD / "bin" / program, "--print-config", "--config", empty.name).stdout
            sections = tomllib.loads(printed)
            self.assertGreater(len(sections), 2)
            for section, keys in sections.items():
                part = re.search(rf"(?ms)^   {section}\n(.*?)(?=^ {{0,3}}\S|\Z)", text)[1]
                for key in keys:
                    self.assertRegex(part, rf"(?m)^     {key}(?= |$)", f"{name} {section}")
            for key, default in re.findall(r"(?m)^#?(\w+) = .*  # default ([^;]*?)(?:;|$)", printed):
                one = re.search(rf"(?ms)^     {key}(?: |\n)(.*?)(?=^     \w|^\S|\Z)", text)[1]
                self.assertIn(f"Default {default}", re.sub(r"\s+", " ", one), key)


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


if __name__ == "__main__":
    unittest.main()
