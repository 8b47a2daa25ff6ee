"""What tools/evaluate runs: prints each figure beside its target; without --quick writes docs/accuracy.md as well."""

import argparse
import sys
import time

import chain
import contacts
import coverage
import instrument
import paper
import report
import resultants

EXPERIMENTS = {  # in the order of the page
    "mechanics": resultants.mechanics,
    "separation": paper.separation,
    "magnitude": paper.magnitude,
    "direction": paper.direction,
    "point_load": paper.point_load,
    "flat_disc": contacts.flat_disc,
    "bias": resultants.bias,
    "monochrome": resultants.monochrome,
    "models": resultants.models,
    "two_contacts": contacts.two_contacts,
    "detection": contacts.detection,
    "coverage": coverage.coverage,
    "rim": coverage.rim,
    "missing": resultants.missing,
    "picture_motion": resultants.picture_motion,
    "large_strain": resultants.large_strain,
    "creep": instrument.creep,
    "calibration": instrument.calibration,
    "centres": instrument.centres,
    "timing": instrument.timing,
}
ORDER = list(EXPERIMENTS)

SLOW = {"separation", "rim"}  # not in --quick: takes ten new inverses; judges nothing

# Figures that must reach their targets for the test to pass; the others are printed. One name a figure, as in
# the experiments. Times are never judged here.
MUST_REACH = [
    "mechanics",
    "magnitude",
    "direction",
    "half-width",
    "disc",
    "two contacts",
    "false splits",
    "detection",
    "false alarms",
    "centre",
    "centre, systematic",
    "calibration",
    "monochrome",
]

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
    arguments = parser.parse_args()
    sections = chain.BUILD / "evaluation-sections"
    sections.mkdir(exist_ok=True)
    missed = []
    for name in arguments.only:
        if arguments.quick and arguments.only == ORDER and name in SLOW:
            continue
        page, begin = report.Report(name, write=not arguments.quick), time.monotonic()
        EXPERIMENTS[name](page, arguments.quick)
        print(f"({time.monotonic() - begin:.0f} s)", flush=True)
        missed += page.missed
        if not arguments.quick:
            (sections / f"{name}.md").write_text(page.finish())
    if not arguments.quick:
        written = [sections / f"{name}.md" for name in ORDER]
        page = "\n".join([HEAD, *[section.read_text() for section in written if section.exists()]])
        (report.SOURCE / "docs" / "accuracy.md").write_text(page)
    if missed:
        print("\nMissed:", "; ".join(missed))
    return int(arguments.quick and any(name in MUST_REACH for name in missed))


if __name__ == "__main__":
    sys.exit(main())
