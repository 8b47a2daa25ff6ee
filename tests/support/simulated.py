"""Breaks the parts that are simulated, and tells what finds it: faults of the past, and mutations at random.

usage: simulated.py list-past [NAME...]               prints the faults; each must fit the committed tree
       simulated.py past PROJECT MINUTES [NAME...]    puts them back in PROJECT, a clone of it, one after another
       simulated.py list-random NUMBER                draws mutations, by TRACTION_SEED
       simulated.py random PROJECT MINUTES NUMBER     makes them
MINUTES: longest search by fresh seeds of the simulation for one fault. Exit codes: those of tools/mutations.
"""

import collections
import os
import pathlib
import re
import shutil
import subprocess
import sys
import time

import mutations
import past_faults
import random_mutations
import seed

MOST_EVENTS = 15  # of a shrunk story
LEAST_FOUND = 0.9
FALSE_ALARM = "without the fault, too: "

Found = collections.namedtuple("Found", "seeds seconds law events")


def whole(project):
    """Returns the path of the simulator without any fault."""
    return project.parent / "simulate-whole"


def keep_whole(project):
    """Builds the simulator without any fault and keeps it. Returns whether it could."""
    if not build(project, None, "simulate"):
        return False
    shutil.copy2(project / "build/release/bin/simulate", whole(project))
    return True


def breaks_without(project, story):
    """Returns whether a story breaks a law without any fault: it then says nothing of one."""
    file = project.parent / "found.story"
    file.write_text(story)
    return subprocess.run([whole(project), "--story", file], stdout=subprocess.DEVNULL, timeout=600,
                          env={**os.environ, "OPENBLAS_NUM_THREADS": "1"}).returncode != 0


def simulate(project, minutes, log):
    """Runs fresh seeds. Returns what was found, None if nothing was."""
    first = seed.fresh()
    command = [project / "build/release/bin/simulate", "--seed", str(first), "--minutes", str(minutes)]
    print(" ".join(map(str, command)), file=log, flush=True)
    began = time.monotonic()
    try:
        ran = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, errors="replace",
                             timeout=60 * minutes + 600, env={**os.environ, "OPENBLAS_NUM_THREADS": "1"})
    except subprocess.TimeoutExpired:
        return Found(1, time.monotonic() - began, "the simulation hangs", None)
    log.write(ran.stdout)
    log.flush()
    if ran.returncode == 0:
        return None
    took = re.findall(r" h simulated in (\d+) s", ran.stdout)
    broken = re.search(r"^seed (\d+) breaks a law after [\d.]+ s: ([^:]+):", ran.stdout, re.M)
    story = re.search(r"^its shortest story, (\d+) of \d+ happenings:\n\n(.*?\n)\n", ran.stdout, re.M | re.S)
    if not broken:
        return Found(1, time.monotonic() - began, f"the simulation ends with {ran.returncode}", None)
    if story and breaks_without(project, story[2]):
        return Found(int(broken[1]) - first + 1, float(took[-1]), FALSE_ALARM + broken[2], None)
    return Found(int(broken[1]) - first + 1, float(took[-1]), broken[2], int(story[1]) if story else None)


def build(project, log, *targets):
    return subprocess.run(["tools/build", "release", *targets], cwd=project, stdout=log, stderr=log).returncode == 0


def put_back(project, fault, minutes, log):
    """Returns what comes of a fault, and whether it was found by a short story."""
    with mutations.made(project, fault.edits):
        if not build(project, log, "simulate"):
            return f"DOES NOT BUILD: {log.name}", False
        found = simulate(project, minutes, log)
    if not found:
        return f"NOT FOUND: {log.name}", False
    told = f"after {found.seeds} seeds, {found.seconds:.0f} s: {found.law}; {found.events} events"
    return told, found.events is not None and found.events <= MOST_EVENTS


def run_past(project, minutes, faults):
    logs, short = mutations.log_folder(project), 0
    if not keep_whole(project):
        return 1
    for fault in faults:
        with open(logs / f"past-{fault.name}.log", "w") as log:
            told, is_short = put_back(project, fault, minutes, log)
        short += is_short
        print(f"{fault.name:24} {fault.commit}  {told}", flush=True)
    print(f"{short} of {len(faults)} faults were found by a story of at most {MOST_EVENTS} events")
    return 0 if short >= LEAST_FOUND * len(faults) else 8


def misfits(named_edits):
    faults = [f"mutations: {name}: {why}" for name, edits in named_edits for one in edits if (why := mutations.edit_misfit(*one))]
    print("\n".join(faults), end="\n" if faults else "", file=sys.stderr)
    return bool(faults)


def past(verb, words):
    project, minutes, names = (words[0], int(words[1]), words[2:]) if verb == "past" else (None, 0, words)
    known = {fault.name: fault for fault in past_faults.FAULTS}
    unknown = [name for name in names if name not in known]
    if unknown:
        print(f"mutations: no fault is called '{unknown[0]}': {', '.join(known)}", file=sys.stderr)
        return 64
    faults = [known[name] for name in names or known]
    if misfits((fault.name, fault.edits) for fault in faults):
        return 65
    if verb == "past":
        return run_past(pathlib.Path(project).resolve(), minutes, faults)
    for fault in faults:
        print(f"{fault.name:24} {fault.commit}  {fault.what}")
    print(f"{len(faults)} faults; each fits the committed tree")
    return 0


def runs(command, log):
    """Returns whether a test program succeeds within two minutes."""
    try:
        return subprocess.run(command, stdout=log, stderr=log, timeout=120,
                              env={**os.environ, "OPENBLAS_NUM_THREADS": "1"}).returncode == 0
    except subprocess.TimeoutExpired:
        return False


def killer(project, one, minutes, log):
    """Makes a mutation. Returns what notices it, "" if nothing does, None if it does not compile."""
    programs = project / "build/release/bin"
    with mutations.made(project, [random_mutations.edit(project, one)]):
        if not build(project, log, f"{one.program}_test"):
            return None
        if not runs([programs / f"{one.program}_test", f"--gtest_filter={one.filter}"], log):
            return f"{one.program}_test"
        if not build(project, log, "simulate", "simulation_test"):
            return None
        if not runs([programs / "simulation_test"], log):
            return "simulation_test"
        found = simulate(project, minutes, log)
    if not found or found.law.startswith(FALSE_ALARM):
        return ""
    return f"fresh seeds, the {found.seeds}th, {found.seconds:.0f} s: {found.law}"


def run_random(project, minutes, number):
    logs, made, killed, skipped = mutations.log_folder(project), 0, 0, 0
    if not keep_whole(project):
        return 1
    for one in random_mutations.drawn(number):
        if made == number:
            break
        with open(logs / f"random-{made + 1}.log", "w") as log:
            told = killer(project, one, minutes, log)
        if told is None:
            skipped += 1
            continue
        made += 1
        killed += bool(told)
        print(f"{made:4} {one.file}:{one.line} {f'killed by {told}' if told else 'SURVIVED'}\n       - {one.old.strip()}\n"
              f"       + {one.new.strip()}", flush=True)
    print(f"{killed} of {made} mutations were killed; {skipped} more did not compile")
    return 0 if made == number and killed >= LEAST_FOUND * made else 8


def main(verb, *words):
    if verb in ("past", "list-past"):
        return past(verb, words)
    if verb == "random":
        return run_random(pathlib.Path(words[0]).resolve(), int(words[1]), int(words[2]))
    for one in random_mutations.drawn(int(words[0])):
        print(f"{one.file}:{one.line} {one.kind}\n       - {one.old.strip()}\n       + {one.new.strip()}")
    return 0


if __name__ == "__main__":
    try:
        sys.exit(main(*sys.argv[1:]))
    except KeyboardInterrupt:
        sys.exit(130)
