"""What the evaluation prints, and docs/accuracy.md: each figure beside its target, each picture beside the paper's."""

import datetime
import pathlib
import re
import subprocess

import numpy as np
from target import bounds

SOURCE = pathlib.Path(__file__).resolve().parents[2]
PAGE = SOURCE / "docs" / "accuracy.md"
PICTURES = PAGE.with_suffix("")


def rms(values, axis=None):
    return np.sqrt(np.mean(np.square(values), axis=axis))


def git(*arguments):
    return subprocess.run(["git", "-C", SOURCE, *arguments], capture_output=True, text=True)


def rewrite_page(order, anew):
    """`anew`: text by experiment; the page keeps its others, in this order, and what people write at its head."""
    head, texts = [], {}
    for part in re.split(r"\n(?=## )", PAGE.read_text()):
        name = re.search(r"^`tools/evaluate --only (\w+)", part, re.M)
        if name:
            texts[name[1]] = texts.get(name[1], "") + "\n" + part
        else:
            head.append(part.rstrip("\n") + "\n\n")
    texts.update(anew)
    PAGE.write_text("\n".join(["\n".join(head).rstrip("\n") + "\n", *(texts[name].rstrip("\n") + "\n" for name in order if name in texts)]))


def stale():
    """Returns the experiments of which a source that their section lists has changed since their commit, or that name none."""
    lines = re.findall(r"^`tools/evaluate --only (\w+).*?`: commit (\w+).*; sources (.*)$", PAGE.read_text(), re.M)
    return {name for name, commit, sources in lines if git("diff", "--quiet", commit, "--", *re.findall(r"`(.+?)`", sources)).returncode}


def shrink(path):
    """To a picture of few colours, a quarter as large."""
    from PIL import Image

    with Image.open(path) as picture:
        small = picture.convert("RGB").quantize(32)
    small.save(path, optimize=True)


class Report:
    """Of one experiment."""

    def __init__(self, experiment, quick, seed, sources):
        """`sources`: paths in the tree on which the figures depend"""
        self.experiment, self.write = experiment, not quick  # write: figures, and text for the page
        self.seed = seed  # of what is drawn anew each time
        self.again = f"{'--quick ' * quick}--only {experiment} --seed {seed}"  # arguments that draw the same loads
        self.sources = sources
        self.text, self.rows = [], []
        self.missed, self.failed = [], False

    def section(self, title, text=""):
        print(f"\n{title}", flush=True)
        print(f"seed {self.seed}: the same again by tools/evaluate {self.again}", flush=True)
        self._end_table()
        changed = git("diff", "--quiet", "HEAD", "--", *self.sources).returncode
        commit = git("rev-parse", "--short=8", "HEAD").stdout.strip() + " with changes" * bool(changed)
        listed = ", ".join(f"`{path}`" for path in self.sources)
        self.text.append(f"\n## {title}\n\n`tools/evaluate {self.again}`: commit {commit}, seed {self.seed}, {datetime.date.today()}; sources {listed}\n")
        if text:
            self.text.append(" ".join(text.split()) + "\n")

    def row(self, figure, measured, target="", value=None, paper="–", within=None, must=False):
        """`value`, a number or several, is held against the target, "<= 3 mm", ">= 93 %" (a share) or "0", or is to lie
        `within` two numbers; a figure without a target is printed. `must`: the test fails where it is missed."""
        verdict = ""
        if target:
            least, most = within or bounds(target)
            good = bool(np.all(least <= np.asarray(value)) and np.all(np.asarray(value) <= most))
            verdict = "ok" if good else "MISSED"
            if not good:
                self.missed.append(figure.strip())
                self.failed |= must
        print(f"{figure:76s} {measured:>34s}   {target:14s} {verdict}", flush=True)
        if not self.rows:
            self.rows = ["| figure | paper | measured | target | |", "|---|---|---|---|---|"]
        self.rows.append(f"| {figure.strip()} | {paper} | {measured} | {target} | {verdict} |")

    def table(self, head, lines):
        self._end_table()
        print("   " + "  ".join(f"{word:>12s}" for word in head))
        for line in lines:
            print("   " + "  ".join(f"{word:>12s}" for word in line), flush=True)
        rows = ["| " + " | ".join(head) + " |", "|" + "---|" * len(head)] + ["| " + " | ".join(l) + " |" for l in lines]
        self.text.append("\n".join(rows) + "\n")

    def picture(self, name, draw, caption, panels=None):
        """For the page. `draw` gets the axes; with `panels` (rows, columns) an array of them."""
        if not self.write:
            return
        self._end_table()
        import matplotlib

        matplotlib.use("Agg")
        from matplotlib import pyplot

        PICTURES.mkdir(parents=True, exist_ok=True)
        figure, axes = pyplot.subplots(*(panels or (1, 1)), figsize=(12, 5.6) if panels else (6, 3.6), dpi=90)
        draw(axes)
        for one in np.ravel(axes):
            one.grid(alpha=0.3)
        figure.tight_layout()
        figure.savefig(PICTURES / f"{name}.png", metadata={"Software": None})
        if panels:
            shrink(PICTURES / f"{name}.png")
        pyplot.close(figure)
        self.text.append(f"![{caption}](accuracy/{name}.png)\n\n{caption}\n")

    def _end_table(self):
        if self.rows:
            self.text.append("\n".join(self.rows) + "\n")
            self.rows = []

    def finish(self):
        """The experiment's section of the page."""
        self._end_table()
        return "\n".join(self.text)
