"""What tools/evaluate runs: prints each figure beside its target; without --quick writes docs/accuracy.md as well."""

import argparse
import concurrent.futures
import contextlib
import io
import os
import sys
import time

import answers
import bodies
import contacts
import coverage
import creep
import few
import grasp
import heat
import instrument
import markers
import paper
import points
import real
import report
import resultants
import seed
import slip
import strokes
import unseen

EXPERIMENTS = {  # in the order of the page
    "mechanics": resultants.mechanics,
    "separation": paper.separation,
    "magnitude": paper.magnitude,
    "direction": paper.direction,
    "point_load": paper.point_load,
    "surface": paper.surface,
    "flat_disc": contacts.flat_disc,
    "bias": resultants.bias,
    "monochrome": resultants.monochrome,
    "wrench": contacts.wrench,
    "coverage": coverage.coverage,
    "shapes": unseen.unseen,
    "answers": answers.answers,
    "slip": slip.slip,
    "points": points.points,
    "grasp": grasp.grasp,
    "strokes": strokes.strokes,
    "missing": resultants.missing,
    "large_strain": resultants.large_strain,
    "creep": creep.creep,
    "heat": heat.heat,
    "calibration": instrument.calibration,
    "centres": instrument.centres,
    "markers": markers.markers,
    "few": few.few,
    "bodies": bodies.bodies,
    "real": real.real,
}
ORDER = list(EXPERIMENTS)
OWN_PICTURES = [name for name in ORDER if name != "real"]

TIMED = {"bodies"}  # measures how long frames take: by itself
SLOW = {"separation", "bias", "coverage", "wrench", "shapes", "answers", "slip", "points", "grasp", "strokes", "few", "bodies"}  # not in --quick, but by name: nothing is judged there

# Paths on which the figures of an experiment depend, besides its own module; DAEMON where it is not listed.
DAEMON = ["daemon/solve", "daemon/track", "sensor", "twin", "tests/evaluation/chain.cpp", "tests/evaluation/chain.py"]
OWN = {
    "mechanics": ["sensor/elastic"],
    "grasp": ["client/examples/gripper", "touch", "twin", "tests/evaluation/grasp.cpp"],
    "strokes": ["client/input/strokes", "tests/evaluation/strokes.cpp"],
    "calibration": ["daemon/calibrate", "sensor", "tests/evaluation/calibrate.cpp"],
    "centres": ["daemon/track", "twin", "tests/evaluation/parts.cpp"],
    "markers": ["daemon/track", "twin", "tests/evaluation/markers.cpp"],
    "slip": [*DAEMON, "touch", "tests/evaluation/slides.py", "tests/evaluation/slip_sequences.py"],
    "shapes": [*DAEMON, "tests/evaluation/limits.py"],
    "few": [*DAEMON, "tests/evaluation/shapes.py", "tests/evaluation/unseen.py"],
    "bodies": [*DAEMON, "gel", "tests/evaluation/fingertip.py"],
    "creep": [*DAEMON, "daemon/calibrate"],
    "real": ["daemon/solve", "daemon/track", "daemon/calibrate", "sensor"],
    "heat": [*DAEMON, "daemon/calibrate"],
    "surface": [*DAEMON, "client/viewer/page/src/round.js", "tests/evaluation/surface.mjs"],
    "large_strain": [*DAEMON, "tests/evaluation/indentation.py"],
}


def sources(name):
    return [f"tests/evaluation/{EXPERIMENTS[name].__module__}.py", *OWN.get(name, DAEMON)]


def evaluate(name, quick, drawn):
    """Returns the report of an experiment, with its text for the page, and what it printed."""
    begin = time.monotonic()
    page = report.Report(name, quick, drawn, sources(name))
    with contextlib.redirect_stdout(io.StringIO()) as printed:
        EXPERIMENTS[name](page, quick)
        text = page.finish()
    return page.missed, page.failed, text, printed.getvalue() + f"({name}: {time.monotonic() - begin:.0f} s)"


def side_by_side(names, *how):
    """Yields the name and evaluate() of each, as they end: as many at a time as there are processors, the slow ones first."""
    with concurrent.futures.ProcessPoolExecutor(os.cpu_count()) as pool:
        names = sorted(names, key=lambda name: name not in SLOW)
        for together in ([name for name in names if name not in TIMED], [name for name in names if name in TIMED]):
            running = {pool.submit(evaluate, name, *how): name for name in together}
            for ended in concurrent.futures.as_completed(running):
                yield running[ended], ended.result()


def main():
    parser = argparse.ArgumentParser(prog="tools/evaluate")
    parser.error = lambda what: parser.exit(64, f"evaluate: {what}; see tools/evaluate --help\n")
    parser.add_argument("--quick", action="store_true", help="fewer trials, no page")
    parser.add_argument(
        "--only", nargs="*", choices=ORDER, default=OWN_PICTURES, help="anew; the page keeps its other sections"
    )
    parser.add_argument("--stale", action="store_true", help="those whose sources have changed since the commit that the page names")
    parser.add_argument("--seed", type=int, default=seed.fresh(), help="of the loads drawn at random")
    words = sys.argv[1:]
    after = words.index("real") + 1 if "real" in words else len(words)
    folder = words.pop(after) if after < len(words) and words[after] not in EXPERIMENTS else None  # of pictures that others own
    arguments = parser.parse_args(words)
    if "real" in arguments.only and not folder:
        parser.error("--only real needs the folder of the sets of pictures, as in --only real FOLDER")
    real.folder = folder
    missed, failed = [], False
    if arguments.stale:
        old = report.stale()
        arguments.only = [name for name in arguments.only if name in old and (name != "real" or folder)]
        print("Stale:", ", ".join(arguments.only) or "none", flush=True)
    if arguments.quick and arguments.only == OWN_PICTURES:
        arguments.only = [name for name in OWN_PICTURES if name not in SLOW]
    for name, (lacking, bad, text, printed) in side_by_side(arguments.only, arguments.quick, arguments.seed):
        print(printed, flush=True)
        missed += lacking
        failed |= bad
        if not arguments.quick:  # at once: what is interrupted goes on with --stale
            report.rewrite_page(ORDER, {name: text})
    if missed:
        print("\nMissed:", "; ".join(missed))
    return int(arguments.quick and failed)


if __name__ == "__main__":
    sys.exit(main())
