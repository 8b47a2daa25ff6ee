"""What tools/evaluate runs: prints each figure beside its target; without --quick writes docs/accuracy.md as well."""

import argparse
import sys
import time

import answers
import bodies
import contacts
import coverage
import creep
import grasp
import heat
import instrument
import markers
import paper
import points
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
    "bodies": bodies.bodies,
}
ORDER = list(EXPERIMENTS)

SLOW = {"separation", "bias", "coverage", "wrench", "shapes", "answers", "slip", "points", "grasp", "strokes", "bodies"}  # not in --quick, but by name: nothing is judged there

HEAD = """# Accuracy

What tractiond measures when the truth is known: marker displacements from CalculiX, an independent finite-element
program, drawn into camera pictures with the default optics (contrast 100, blur 0.8 px, cross-talk 20 %, noise 2
levels), through the whole chain. E = 0.18 MPa, Poisson's ratio 0.49, a block of 100 x 100 x 40 mm unless something else
is said; 1 gf = 9.80665 mN. The paper is Kamiyama et al. 2005. This page is written by

    tools/evaluate

and the truth in `tests/evaluation/data` by `tools/evaluate --truth`. Errors are root mean squares over trials.
"""


def main():
    parser = argparse.ArgumentParser(prog="tools/evaluate")
    parser.error = lambda what: parser.exit(64, f"evaluate: {what}; see tools/evaluate --help\n")
    parser.add_argument("--quick", action="store_true", help="fewer trials, no page")
    parser.add_argument(
        "--only", nargs="*", choices=ORDER, default=ORDER, help="anew; the page keeps its other sections"
    )
    parser.add_argument("--seed", type=int, default=seed.fresh(), help="of the loads drawn at random")
    arguments = parser.parse_args()
    missed, failed, sections = [], False, {}
    for name in arguments.only:
        if arguments.quick and arguments.only == ORDER and name in SLOW:
            continue
        begin = time.monotonic()
        page = report.Report(name, arguments.quick, arguments.seed)
        EXPERIMENTS[name](page, arguments.quick)
        print(f"({time.monotonic() - begin:.0f} s)", flush=True)
        missed += page.missed
        failed |= page.failed
        sections[name] = page.finish()
    if not arguments.quick:
        report.rewrite_page(HEAD, ORDER, sections)
    if missed:
        print("\nMissed:", "; ".join(missed))
    return int(arguments.quick and failed)


if __name__ == "__main__":
    sys.exit(main())
