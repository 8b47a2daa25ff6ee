"""Counts what tests/test has run, and lists what there is.

usage: tally.py gate PRESET...   a test that failed, did not run, skipped a case or had none is a failure
       tally.py all PRESET...    prints figures, and what failed
       tally.py list PRESET      prints each ctest test of a configured build with its suite
Reads build/PRESET/tests.xml, which ctest has written (--output-junit).
"""

import collections
import json
import pathlib
import re
import subprocess
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


def listing(presets):
    shown = subprocess.run(["ctest", "--preset", presets[0], "--show-only=json-v1"], cwd=SOURCE, stdout=subprocess.PIPE,
                           check=True).stdout
    for test in sorted(json.loads(shown)["tests"], key=lambda test: test["name"]):
        labels = next((each["value"] for each in test["properties"] if each["name"] == "LABELS"), [])
        suite = "gate" if "gate" in labels else "all, " + next(label for label in labels if label != "all")
        print(f"{presets[0]:8} {test['name']:36} {suite}")
    return 0


def main(words):
    verbs = {"gate": gate, "all": everything, "list": listing}
    if len(words) < 2 or words[0] not in verbs:
        print(__doc__, file=sys.stderr)
        return 64
    return verbs[words[0]](words[1:])


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
