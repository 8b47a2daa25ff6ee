"""Manual pages and completions hold what --help and --print-config print, and man, mandoc and bash take them."""

import os
import pathlib
import pty
import random
import re
import select
import shutil
import subprocess
import sys
import tempfile
import time
import tomllib
import unittest

from stubs import SOURCE

BUILD = pathlib.Path(os.environ["TRACTION_BUILD"])
MANUAL = BUILD / "manual"
SECTIONS = {"tractiond": 8, "traction-gateway": 8, "tractionctl": 1, "traction-twin": 1, "traction-lens": 1}
PROGRAMS = [name for name in SECTIONS if (BUILD / "bin" / name).exists()]
CONFIGURATIONS = {"tractiond.toml": "tractiond", "traction-gateway.toml": "traction-gateway"}
PAGES = [f"{name}.{SECTIONS[name]}" for name in PROGRAMS] + [f"{name}.5" for name in CONFIGURATIONS]
ENV = {**os.environ, "PATH": f"{BUILD / 'bin'}:{os.environ['PATH']}", "LC_ALL": "C.UTF-8"}

OPTION = r"  (?:-\w,)?(--[\w-]+)(?: ([A-Z]\S*(?:, [^}]*})?))?"  # as --help has it, with what its value is


def run(*command, **options):
    return subprocess.run(command, env=ENV, stdin=subprocess.DEVNULL, capture_output=True, text=True, timeout=60,
                          **options)


class Help:
    """What --help of a command prints, read line by line."""

    def __init__(self, *path):
        self.path = path
        self.text = run(BUILD / "bin" / path[0], *path[1:], "--help").stdout
        section, self.options, self.values, self.commands, self.exits = "", [], {}, [], []
        for line in self.text.splitlines():
            if line.endswith(":") and line[0] != " ":
                section = line
            elif section == "Options:" and (found := re.match(OPTION, line)):
                self.options.append(found[1])
                self.values[found[1]] = found[2] or ""
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
                if shutil.which("man"):
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

    def test_any_words_are_read_as_they_were_written(self):
        sys.path.insert(0, str(SOURCE / "manual"))
        import mdoc
        seed = random.randrange(10**6)
        draw = random.Random(seed)
        words = [".Sh", "'br", "\\fB", "--some-flag", "a-b", "Fl", "No", '"said"', "e.g.", "End.", "(x).", "%", "\\",
                 "-1", "|"]
        for _ in range(20):
            text = " ".join(draw.choices(words, k=draw.randint(1, 60)))
            tags = draw.choices(words, k=4)
            with tempfile.NamedTemporaryFile("w", suffix=".1") as page:
                entries = ([f".It Ar {mdoc.literal(tag)}", "of it"] for tag in tags)
                page.write("\n".join([*mdoc.header("x", 1), ".Sh NAME", ".Nm x", ".Nd y", ".Sh DESCRIPTION",
                                      mdoc.prose(text), *mdoc.table(entries), ""]))
                page.flush()
                rendered = run("mandoc", "-Tutf8", "-Owidth=500", page.name, check=True).stdout
            shown = re.search(r"(?s)DESCRIPTION(.*)\n[^\n]+\n*\Z", re.sub(".\b", "", rendered))[1].split()
            self.assertEqual(shown, text.split() + " of it ".join([*tags, ""]).split(), f"seed {seed}")


class Completion(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        seed = random.randrange(10**6)
        print(f"\n  seed {seed}")
        cls.random = random.Random(seed)

    def complete(self, *words, cwd=SOURCE):
        """What bash's own variables lead to; the last word is the one to be completed."""
        script = (f"source '{MANUAL / words[0]}'\nCOMP_WORDS=(\"$@\") COMP_CWORD=$(($# - 1))\n"
                  f"function=$(complete -p {words[0]} | sed 's/.*-F \\(\\S*\\) .*/\\1/')\n"
                  "$function \"$1\" \"${@: -1}\" \"${@: -2:1}\"\n"
                  "[ ${#COMPREPLY[@]} = 0 ] || printf '%s\\n' \"${COMPREPLY[@]}\"")
        done = run("bash", "--norc", "-c", script, "bash", *words, cwd=cwd)
        self.assertEqual((done.returncode, done.stderr), (0, ""))
        return done.stdout.splitlines()

    def start_of(self, word):
        return word[:self.random.randint(2 if word.startswith("--") else 0, len(word))]

    def test_what_help_shows_is_offered(self):
        for program in PROGRAMS:
            for help in Help(program).all():
                with self.subTest(" ".join(help.path)):
                    offered = self.complete(*help.path, "-")
                    self.assertEqual(len(offered), len(set(offered)), offered)
                    for option in help.options:
                        self.assertIn(option, offered)
                        choices = re.search(r"{(.*)}", help.values[option])
                        if choices:
                            words = re.split(", *", choices[1])
                            self.assertEqual(set(self.complete(*help.path, option, "")), set(words))
                            self.assertEqual(set(self.complete(*help.path, option, "=", "")), set(words))
                    if help.commands:
                        self.assertEqual(set(self.complete(*help.path, "")), set(help.commands))
                    for word in self.random.sample(help.options + help.commands, min(3, len(help.options))):
                        self.assertIn(word, self.complete(*help.path, self.start_of(word)))

    def test_a_value_is_no_command(self):
        self.assertIn("status", self.complete("tractionctl", "--instance", "camera", "st"))
        self.assertIn("list", self.complete("tractionctl", "--instance", "=", "keys", "camera", ""))
        self.assertEqual(self.complete("tractionctl", "--server-key", ""), [])

    def test_an_option_of_the_program_may_stand_behind_the_command(self):
        self.assertIn("--instance", self.complete("tractionctl", "echo", "--"))
        self.assertNotIn("--instance", self.complete("tractionctl", "echo", "--topic", "--"))

    def test_a_commands_own_option_is_not_the_programs(self):
        self.assertIn("--directory", self.complete("tractionctl", "keys", "allow", "--control", "--d"))
        self.assertEqual(self.complete("tractionctl", "--control", "--d"), [])

    def test_operands(self):
        self.assertEqual(self.complete("tractionctl", "calibrate", "geometry", "we"), ["weights"])
        self.assertIn("idle", self.complete("traction-twin", "i"))
        self.assertIn("default", self.complete("tractiond", "--instance", ""))

    def test_files_and_directories(self):
        with tempfile.TemporaryDirectory() as folder:
            for name in ("a b.toml", "ab"):
                (pathlib.Path(folder) / name).touch()
            (pathlib.Path(folder) / "adir").mkdir()
            self.assertEqual(set(self.complete("tractiond", "--config", "a", cwd=folder)), {"a b.toml", "ab", "adir"})
            self.assertEqual(self.complete("tractiond", "--state", "a", cwd=folder), ["adir"])
            self.assertIn("a b.toml", self.complete("tractionctl", "snapshot", "a", cwd=folder))

    def test_on_a_terminal(self):
        """The key that people press."""
        pid, terminal = pty.fork()
        if pid == 0:
            plain = {**ENV, "TERM": "dumb", "PS1": "", "HISTFILE": ""}
            os.execvpe("bash", ["bash", "--norc", "--noprofile", "-i"], plain)
        os.write(terminal, f"source '{MANUAL}/tractionctl'; tractionctl() {{ echo called: \"$@\"; }}\n".encode())
        os.write(terminal, b"tractionctl ech\t--topic=descr\t --ins\tdefa\t\n")
        text, end = "", time.monotonic() + 20
        while not re.search("(?m)^called: .*\n", text) and time.monotonic() < end:
            if select.select([terminal], [], [], 0.5)[0]:
                text += os.read(terminal, 4096).decode()
        os.write(terminal, b"exit\n")
        os.close(terminal)
        os.waitpid(pid, 0)
        self.assertRegex(text, r"(?m)^called: echo --topic=description --instance default")


if __name__ == "__main__":
    unittest.main()
