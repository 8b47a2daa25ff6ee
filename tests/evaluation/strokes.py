"""Letters by strokes: how many are read of those that writers draw. Called like the paper's experiments; strokes.cpp draws them."""

import chain
from report import SOURCE

ALPHABET = SOURCE / "config" / "input" / "strokes" / "alphabet.toml"
TARGETS = {"own": 0.99, "foreign": 0.97}


def strokes(report, quick):
    writers, each = (4, 2) if quick else (60, 2)
    report.section(
        "Letters by strokes",
        f"""
        Strokes of 6 to 25 mm, 30 to 120 mm/s at 60 frames/s, with tremor (8 to 12 Hz), other slant, turn, aspect, ends and shape
        each time, by {writers} writers each of whom has own shapes, slant and aspect throughout. Own: by three strokes of each symbol that the writer
        recorded; foreign: by the shipped alphabet. A doubtful stroke writes nothing, and counts as not read.""",
    )
    for line in chain.call("strokes", ALPHABET, writers, each, report.seed).splitlines():
        mode, templates, *counts = line.split()
        count, right, doubtful = map(int, counts)
        report.row(
            f"{mode}, {templates} templates: read; doubtful; wrong",
            f"{100 * right / count:.2f} %; {100 * doubtful / count:.2f} %; {100 * (count - right - doubtful) / count:.2f} % of {count}",
            f">= {100 * TARGETS[templates]:.0f} %",
            right / count,
        )
