"""Prints the lines of each room that the gate runs, beside those that all tests run.

usage: coverage.py GATE.json ALL.json     gcovr's summaries
"""

import collections
import json
import pathlib
import sys

ALLOWED = 5.0  # points that the gate may be behind


def room_of(file):
    """Returns the room of a source file: a folder of daemon/, or of the tree; client/viewer is one of its own."""
    parts = pathlib.PurePath(file).parts
    if parts[0] == "daemon" or parts[:2] == ("client", "viewer"):
        return parts[1]
    return parts[0]


def shares_of(path):
    """Returns {room: (lines, percent of them that ran)}."""
    lines, ran = collections.Counter(), collections.Counter()
    for file in json.loads(pathlib.Path(path).read_text())["files"]:
        lines[room_of(file["filename"])] += file["line_total"]
        ran[room_of(file["filename"])] += file["line_covered"]
    return {room: (lines[room], 100.0 * ran[room] / lines[room]) for room in sorted(lines) if lines[room]}


def main(gate, everything):
    gate, everything = shares_of(gate), shares_of(everything)
    print("| room | lines | gate, % | all, % | behind, points |\n|---|---|---|---|---|")
    for room, (lines, share) in everything.items():
        behind = share - gate[room][1]
        missed = "" if behind <= ALLOWED else ": MISSED"
        print(f"| {room} | {lines} | {gate[room][1]:.1f} | {share:.1f} | {behind:.1f}{missed} |")


if __name__ == "__main__":
    main(*sys.argv[1:])
