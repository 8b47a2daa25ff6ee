"""Counts what tools/test has run.

usage: tally.py gate PRESET...   a test that failed, did not run, skipped a case or had none is a failure
       tally.py all PRESET...    prints figures, and what failed
Reads build/PRESET/tests.xml, which ctest has written (--output-junit).
"""

import collections
import pathlib
import re
import sys
import xml.etree.ElementTree

SOURCE = pathlib.Path(__file__).resolve().parents[2]

Result = collections.namedtuple("Result", "name seconds passed cases skipped text")


def cases_of(text):
    """Returns how many test cases a GoogleTest or unittest program says it ran, and the lines that name those it skipped."""
    ran = [int(number) for number in re.findall(r"^(?:\[==========\]|Ran) (\d+) tests? (?:from .* ran\.|in )", text, re.M)]
    skipped = re.findall(r"^(?:\[  SKIPPED \] \S+ \(.*|.*\.\.\. skipped .*)$", text, re.M)
    return (sum(ran) if ran else 1) - len(skipped), skipped


def results_of(preset):
    """Returns the results of a preset's last run."""
    tree = xml.etree.ElementTree.parse(SOURCE / "build" / preset / "tests.xml")
    results = []
    for case in tree.iter("testcase"):
        text = case.findtext("system-out") or ""
        cases, skipped = cases_of(text)
        results.append(Result(case.get("name"), float(case.get("time")), case.get("status") == "run", cases, skipped, text))
    return sorted(results)


def gate(presets):
    cases, faults = 0, []
    for preset in presets:
        for result in results_of(preset):
            cases += result.cases
            if not result.passed:
                faults.append(f"failed: {preset} {result.name}")
            elif not result.cases and not result.skipped:
                faults.append(f"missing: {preset} {result.name}: no case ran")
            faults += [f"missing: {preset} {result.name}: {line.strip()}" for line in result.skipped]
    print(f"gate: {cases} test cases ran")
    print("".join(f"gate: {line}\n" for line in faults), end="")
    return 1 if faults else 0


def everything(presets):
    failed = []
    for preset in presets:
        for result in results_of(preset):
            figures = [line.rstrip() for line in result.text.splitlines() if re.match(r"  (?!seed )\S", line)]
            if figures or not result.passed:
                print(f"\n{preset} {result.name}: {'held' if result.passed else 'MISSED'}, {result.seconds:.0f} s")
                print("\n".join(figures))
            if not result.passed:
                why = re.search(r"^.*(?:Failure|AssertionError|Error:).*$(?:\n.+){0,3}", result.text, re.M)
                failed.append(f"{preset} {result.name}\n    " + (why[0].replace("\n", "\n    ") if why else "no reason printed"))
    print(f"\n{len(failed)} missed" + "".join("\n  " + line for line in failed))
    return 1 if failed else 0


def main(words):
    verbs = {"gate": gate, "all": everything}
    if len(words) < 2 or words[0] not in verbs:
        print(__doc__, file=sys.stderr)
        return 64
    return verbs[words[0]](words[1:])


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
