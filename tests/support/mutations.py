"""Breaks the code on purpose, one fault after another, and tells what notices it. usage: see tools/mutations --help

Mutations are drawn by TRACTION_SEED: a condition that always or never holds, a constant that is 0, a call that is left out.
"""

import argparse
import collections
import os
import pathlib
import re
import subprocess
import sys

import seed

SOURCE = pathlib.Path(__file__).resolve().parents[2]
PAST = SOURCE / "tests/mutations"
ROOMS = ("base", "sensor", "recording", "daemon", "gateway", "twin", "lens", "client/src", "client/files", "client/show", "client/cli")
# Tests elsewhere, and what they need, where what a room encodes is decoded, and the other way round.
ELSEWHERE = {"daemon/publish/": ("client", "client_test"), "client/src/": ("clients.conformance", "conformance_reader")}
SIMULATED = ("base/", "daemon/app/", "daemon/capture/", "daemon/control/")
ENOUGH = 0.9

Mutation = collections.namedtuple("Mutation", "file line old new")


def closing(text, at):
    """Returns the index of the bracket that closes the one at `at`; None: it is not on this line."""
    depth = 0
    for i in range(at, len(text)):
        depth += {"(": 1, ")": -1}.get(text[i], 0)
        if depth == 0:
            return i
    return None


def conditions(line):
    """Yields the line with a condition that holds always, or never."""
    for found in re.finditer(r"\b(?:if|while) \(", line):
        begin = found.end() - 1
        end = closing(line, begin)
        inner = line[begin + 1:end] if end else ";"
        if ";" in inner or re.match(r"(?:const|auto|int|T\*) ?", inner) or " = " in inner:
            continue
        yield from (f"{line[:begin]}({word} ({inner}){line[end:]}" for word in ("true ||", "false &&"))


def constants(line):
    """Yields the line with a number that is 0; 1 where it was 0."""
    for found in re.finditer(r"(?<![\w.'\"<{])\d[\d']*(?:\.\d+)?(?:e\d+)?(?![\w.'\"x>])", line):
        new = "1" if float(found[0].replace("'", "")) == 0 else "0"
        yield line[:found.start()] + new + line[found.end():]


def calls(line):
    """Yields the line without its call or assignment, if it is a whole statement."""
    if re.match(r"^ +(?!return\b|const\b|auto\b|using\b|static|if\b|for\b|else\b|while\b|break\b)[\w:.>*\[\]-]+(?:\(.*\)| [-+|]?= .*);$", line) \
            and line.count("(") == line.count(")"):
        yield re.match(r" +", line)[0] + ";"


def draw(places, number):
    """Draws mutations of the committed sources under the places. Three times `number`, as some do not compile."""
    files = subprocess.run(["git", "ls-files", *places], cwd=SOURCE, stdout=subprocess.PIPE, text=True, check=True).stdout.split()
    found = []
    for file in files:
        if not file.endswith((".cpp", ".h")) or not tests_of(file):
            continue
        for number_of_line, line in enumerate((SOURCE / file).read_text().splitlines()):
            code = re.sub(r" *//.*", "", line)
            if code.strip() and not code.lstrip().startswith(("#", "static_assert", "assert")) and '"' not in code:
                found += [Mutation(file, number_of_line, line, new) for kind in (conditions, constants, calls) for new in kind(code)]
    return seed.chance("mutations").sample(found, min(3 * number, len(found)))


def tests_of(file):
    """Returns {ctest test: target} of the unit tests of a file's room, and of those elsewhere that run it."""
    listings = [listing for room in reversed(file.split("/")[:-1])
                if (listing := SOURCE / "tests/unit" / room / "CMakeLists.txt").exists()]
    tests = re.findall(r"traction_test\((\w+)", listings[0].read_text()) if listings else []
    return {name: f"{name}_test" for name in tests} | dict(pair for room, pair in ELSEWHERE.items() if file.startswith(room))


def run(project, log, *command, seconds=900):
    try:
        return subprocess.run(command, cwd=project, stdout=log, stderr=log, timeout=seconds,
                              env={**os.environ, "OPENBLAS_NUM_THREADS": "1"}).returncode
    except subprocess.TimeoutExpired:
        return 124


def simulation_breaks(project, log, minutes):
    """Returns whether fresh seeds of the simulation break a law."""
    return run(project, log, "build/release/bin/simulate", "--seed", str(seed.fresh()), "--minutes", str(minutes),
               seconds=60 * minutes + 600) != 0


def verdict(project, one, minutes, log):
    """Makes a mutation. Returns what notices it, "" if nothing does, None if it does not compile."""
    lines = (project / one.file).read_text().splitlines(keepends=True)
    (project / one.file).write_text("".join([*lines[:one.line], one.new + "\n", *lines[one.line + 1:]]))
    tests = tests_of(one.file)
    if one.file.startswith(SIMULATED) and minutes:
        tests["simulation"] = "simulation_test"
    known = subprocess.run(["ninja", "-C", "build/release", "-t", "targets", "all"], cwd=project, stdout=subprocess.PIPE, text=True).stdout
    tests = {name: target for name, target in tests.items() if f"\n{target}: phony" in known}
    if run(project, log, "tools/build", "release", *tests.values()) != 0:
        return None
    with open(log.name, "r+") as read:
        read.seek(0, os.SEEK_END)
        code = run(project, log, "ctest", "--preset", "release", "-R", f"^({'|'.join(map(re.escape, tests))})$", "--no-tests=error",
                   "--stop-on-failure", "--timeout", "120", "--parallel", str(os.cpu_count()))
        failed = re.findall(r"^\[  FAILED  \] ([\w/]+\.[\w/]+)|\*\*\*(Timeout|Exception.*)", read.read(), re.M)
    if code != 0:
        return next(("".join(each) for each in failed), "a test")
    if one.file.startswith(SIMULATED) and minutes:
        if run(project, log, "tools/build", "release", "simulate") == 0 and simulation_breaks(project, log, minutes):
            return "fresh seeds of the simulation"
    return ""


def run_random(project, drawn, number, minutes):
    made = killed = 0
    for one in drawn:
        if made == number:
            break
        with open(project.parent / f"random-{made + 1}.log", "w") as log:
            told = verdict(project, one, minutes, log)
        subprocess.run(["git", "checkout", "--quiet", "."], cwd=project, check=True)
        if told is None:
            continue
        made, killed = made + 1, killed + bool(told)
        print(f"{made:4} {one.file}:{one.line + 1} {f'killed by {told}' if told else 'SURVIVED'}\n       - {one.old.strip()}\n"
              f"       + {one.new.strip()}", flush=True)
    print(f"{killed} of {made} mutations were killed")
    return 0 if made == number and killed >= ENOUGH * made else 8


def moved(patch):
    """Returns a patch's text with the paths that its files have today; its lines may have moved as well."""
    files = subprocess.run(["git", "ls-files"], cwd=SOURCE, stdout=subprocess.PIPE, text=True, check=True).stdout.split()
    paths = collections.defaultdict(list)
    for file in files:
        paths[file.rpartition("/")[2]].append(file)
    text = patch.read_text()
    for path in set(re.findall(r"^--- a/(.*)", text, re.M)):
        today = paths[path.rpartition("/")[2]]
        if path not in files and len(today) == 1:
            text = text.replace(f"a/{path}\n", f"a/{today[0]}\n").replace(f"b/{path}\n", f"b/{today[0]}\n")
    return text


def apply(project, patch):
    return subprocess.run(["patch", "-p1", "--fuzz=2", "--silent", "--force", "--no-backup-if-mismatch"], cwd=project,
                          input=moved(patch), text=True, stdout=subprocess.DEVNULL).returncode == 0


def run_past(project, patches, minutes):
    found = 0
    for patch in patches:
        with open(project.parent / f"past-{patch.stem}.log", "w") as log:
            if not apply(project, patch):
                told = "does not apply any more"
            elif run(project, log, "tools/build", "release", "simulate") != 0:
                told = "DOES NOT BUILD"
            else:
                broken = simulation_breaks(project, log, minutes)
                found += broken
                told = "found" if broken else "NOT FOUND"
        subprocess.run(["git", "checkout", "--quiet", "."], cwd=project, check=True)
        print(f"{patch.stem:24} {told}", flush=True)
    print(f"{found} of {len(patches)} faults were found")
    return 0 if found >= ENOUGH * len(patches) else 8


def clone():
    """Returns a clone of the committed tree, in which the faults are made."""
    project = SOURCE / "build/mutations/project"
    if (project / ".git").exists():
        subprocess.run(["git", "-C", project, "fetch", "--quiet", SOURCE, "HEAD"], check=True)
        subprocess.run(["git", "-C", project, "reset", "--quiet", "--hard", "FETCH_HEAD"], check=True)
    else:
        subprocess.run(["git", "clone", "--quiet", SOURCE, project], check=True)
    subprocess.run(["cmake", "--preset", "release"], cwd=project, check=True)
    return project


def main():
    words = argparse.ArgumentParser(prog="tools/mutations")
    words.error = lambda what: words.exit(64, f"mutations: {what}; see tools/mutations --help\n")
    kind = words.add_mutually_exclusive_group(required=True)
    kind.add_argument("--random", type=int)
    kind.add_argument("--past", action="store_true")
    words.add_argument("--minutes", type=int, default=0)
    words.add_argument("places", nargs="*")
    words = words.parse_args()
    if words.past:
        patches = [PAST / f"{name}.patch" for name in words.places] or sorted(PAST.glob("*.patch"))
        return run_past(clone(), patches, words.minutes or 10)
    return run_random(clone(), draw(words.places or ROOMS, words.random), words.random, words.minutes)


if __name__ == "__main__":
    try:
        sys.exit(main())
    except KeyboardInterrupt:
        sys.exit(130)
