"""Manual pages and completions hold what --help and --print-config print, and man, mandoc and bash take them."""

import os
import pathlib
import pty
import re
import select
import subprocess
import sys
import tempfile
import time
import tomllib
import unittest

import seed
from stubs import SOURCE

BUILD = pathlib.Path(os.environ["TRACTION_BUILD"])
MANUAL = BUILD / "manual"
SECTIONS = {"tractiond": 8, "traction-gateway": 8, "tractionctl": 1, "traction-twin": 1, "traction-lens": 1, "traction-view": 1}
# A machine that npm does not reach cannot build the viewer.
PROGRAMS = [name for name in SECTIONS if name != "traction-view" or (BUILD / "bin" / name).exists()]
CONFIGURATIONS = {"tractiond.toml": "tractiond", "traction-gateway.toml": "traction-gateway"}
PAGES = [f"{name}.{SECTIONS[name]}" for name in PROGRAMS] + [f"{name}.5" for name in CONFIGURATIONS]
ENV = {**os.environ, "PATH": f"{BUILD / 'bin'}:{os.environ['PATH']}", "LC_ALL": "C.UTF-8"}

OPTION = r"  (?:-\w,)?(--[\w-]+)(?: ([A-Z]\S*(?:, [^}]*})?))?"  # as --help has it, with what its value is


def run(*command, **options):
    return subprocess.run(command, env=ENV, stdin=subprocess.DEVNULL, capture_output=True, text=True, timeout=120,
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
        draw = seed.chance(self.id())
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
            self.assertEqual(shown, text.split() + " of it ".join([*tags, ""]).split())


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


class Zsh:
    """One at a terminal of its own; what it would add to its list it writes into a file."""

    name = "zsh"
    SETUP = """PS1= RPS1= LISTMAX=10000; unsetopt auto_list auto_menu beep zle_bracketed_paste
fpath=({manual} $fpath); autoload -Uz compinit; compinit -u -D
compadd() {{
  if [[ " ${{@[1,(i)(-|--)]}}" != *\\ -(O|A|D)\\ * ]]; then
    local -a found; builtin compadd -O found "$@"; print -rl -- $found >>{out}
  fi
  builtin compadd "$@"
}}
capture() {{ zle complete-word; print END >>{out} }}
zle -N capture; bindkey '^T' capture; bindkey '^U' kill-whole-line; : >{ready}
"""

    def __init__(self, test):
        folder = pathlib.Path(test.enterContext(tempfile.TemporaryDirectory(prefix="traction-zsh-")))
        self.out, ready, setup = folder / "out", folder / "ready", folder / "setup"
        setup.write_text(self.SETUP.format(manual=MANUAL, out=self.out, ready=ready))
        self.pid, self.terminal = pty.fork()
        if self.pid == 0:
            os.execvpe("zsh", ["zsh", "-f", "-i"], {**ENV, "TERM": "dumb"})
        test.addCleanup(self.end)
        self.type(f"source {setup}\n")
        self.wait(ready.exists)
        self.cwd = None

    def end(self):
        os.close(self.terminal)
        os.waitpid(self.pid, 0)

    def type(self, text):
        os.write(self.terminal, text.encode())

    def wait(self, condition):
        end = time.monotonic() + 120
        while not condition():
            assert time.monotonic() < end, "zsh does not answer"
            if select.select([self.terminal], [], [], 0.01)[0]:
                os.read(self.terminal, 65536)

    def complete(self, *words, cwd=SOURCE):
        self.out.write_text("")
        self.type(f"\x15cd {cwd}\n" if cwd != self.cwd else "")
        self.cwd = cwd
        self.type("\x15" + " ".join(words) + "\x14")
        self.wait(lambda: self.out.read_text().endswith("END\n"))
        return [line for line in self.out.read_text().split("\n")[:-2] if line]


def said(*command, **options):
    done = run(*command, **options)
    assert (done.returncode, done.stderr) == (0, ""), done
    return done.stdout.splitlines()


class Completion(unittest.TestCase):
    def setUp(self):
        self.draw = seed.chance(self.id())
        self.shells = [Bash(), Fish(), Zsh(self)]

    def start_of(self, word):
        return word[:self.draw.randint(3 if word.startswith("--") else 0, len(word))]

    def test_what_help_shows_is_offered(self):
        helps = [help for program in PROGRAMS for help in Help(program).all()]
        for shell in self.shells:
            with self.subTest(shell.name):
                for help in helps:
                    offered = shell.complete(*help.path, "--")
                    self.assertLessEqual(set(help.options), set(offered), help.path)
                    self.assertEqual(len(offered), len(set(offered)), offered)
                    for option in help.options:
                        choices = re.search(r"{(.*)}", help.values[option])
                        if choices:
                            offered = shell.complete(*help.path, option, "")
                            self.assertEqual(set(offered), set(re.split(", *", choices[1])))
                    if help.commands:
                        self.assertEqual(set(shell.complete(*help.path, "")), set(help.commands), help.path)
                    word = self.draw.choice(help.options + help.commands)
                    self.assertIn(word, shell.complete(*help.path, self.start_of(word)))

    def test_a_value_is_no_command(self):
        for shell in self.shells:
            with self.subTest(shell.name):
                self.assertIn("status", shell.complete("tractionctl", "--instance", "camera", "st"))
                self.assertEqual(shell.complete("tractionctl", "--server-key", ""), [])

    def test_a_value_may_stand_behind_an_equals_sign(self):
        self.assertEqual(Bash().complete("tractionctl", "echo", "--topic", "=", "fi"), ["field"])  # as bash splits it
        self.assertEqual(Bash().complete("tractionctl", "--instance", "=", "keys", "camera", "l"), ["list"])
        self.assertEqual(Fish().complete("tractionctl", "echo", "--topic=fi"), ["--topic=field"])
        self.assertEqual(set(self.shells[2].complete("tractionctl", "echo", "--topic=fi")), {"field"})

    def test_an_option_of_the_program_may_stand_behind_the_command(self):
        for shell in self.shells:
            with self.subTest(shell.name):
                self.assertIn("--instance", shell.complete("tractionctl", "echo", "--"))
                self.assertEqual(set(shell.complete("tractionctl", "echo", "--topic", "fi")), {"field"})

    def test_a_commands_own_option_is_not_the_programs(self):
        for shell in self.shells:
            with self.subTest(shell.name):
                self.assertIn("--directory", shell.complete("tractionctl", "keys", "allow", "--control", "--d"))
                self.assertEqual(shell.complete("tractionctl", "--control", "zz"), [])

    def test_operands(self):
        for shell in self.shells:
            with self.subTest(shell.name):
                self.assertEqual(set(shell.complete("tractionctl", "calibrate", "geometry", "we")), {"weights"})
                self.assertIn("idle", shell.complete("traction-twin", "i"))
                self.assertIn("default", shell.complete("tractiond", "--instance", ""))

    def test_files_and_directories(self):
        with tempfile.TemporaryDirectory() as folder:
            (pathlib.Path(folder) / "ab").touch()
            (pathlib.Path(folder) / "adir").mkdir()
            for shell in self.shells:
                with self.subTest(shell.name):
                    self.assertEqual(set(shell.complete("tractiond", "--config", "a", cwd=folder)), {"ab", "adir"})
                    self.assertEqual(set(shell.complete("tractiond", "--state", "a", cwd=folder)), {"adir"})
                    self.assertIn("ab", shell.complete("tractionctl", "snapshot", "a", cwd=folder))
            (pathlib.Path(folder) / "a b").touch()
            self.assertIn("a b", Bash().complete("tractionctl", "snapshot", "a", cwd=folder))

    def test_on_a_terminal(self):
        """The key that people press, in bash."""
        pid, terminal = pty.fork()
        if pid == 0:
            plain = {**ENV, "TERM": "dumb", "PS1": "", "HISTFILE": ""}
            os.execvpe("bash", ["bash", "--norc", "--noprofile", "-i"], plain)
        os.write(terminal, f"source '{MANUAL}/tractionctl'; tractionctl() {{ echo called: \"$@\"; }}\n".encode())
        os.write(terminal, b"tractionctl ech\t--topic=descr\t --ins\tdefa\t\n")
        text, end = "", time.monotonic() + 120
        while not re.search("(?m)^called: .*\n", text) and time.monotonic() < end:
            if select.select([terminal], [], [], 0.5)[0]:
                text += os.read(terminal, 4096).decode()
        os.write(terminal, b"exit\n")
        os.close(terminal)
        os.waitpid(pid, 0)
        self.assertRegex(text, r"(?m)^called: echo --topic=description --instance default")


if __name__ == "__main__":
    unittest.main()
