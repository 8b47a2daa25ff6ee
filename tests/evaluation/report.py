"""What the evaluation prints, and docs/accuracy.md: each figure beside its target, each picture beside the paper's."""

import pathlib

import numpy as np

SOURCE = pathlib.Path(__file__).resolve().parents[2]
PICTURES = SOURCE / "docs" / "accuracy"


def rms(values, axis=None):
    return np.sqrt(np.mean(np.square(values), axis=axis))


class Report:
    """Of one experiment."""

    def __init__(self, experiment, write=False):
        self.experiment, self.write = experiment, write  # write: pictures, and text for the page
        self.text, self.rows = [], []
        self.missed = []

    def section(self, title, text=""):
        print(f"\n{title}", flush=True)
        self._end_table()
        self.text.append(f"\n## {title}\n\n`tools/evaluate --only {self.experiment}`\n")
        if text:
            self.text.append(" ".join(text.split()) + "\n")

    def row(self, figure, measured, paper="–", target="", limit=None, value=None, least=None, name=None):
        """`value` is held against `limit` (at most), or `least` (at least) as well; a figure without one is printed."""
        verdict = ""
        if limit is not None or least is not None:
            good = value is not None and (limit is None or value <= limit) and (least is None or value >= least)
            verdict = "ok" if good else "MISSED"
            if not good:
                self.missed.append(name or figure)
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

    def picture(self, name, draw, caption):
        """`draw` gets the axes."""
        if not self.write:
            return
        self._end_table()
        import matplotlib

        matplotlib.use("Agg")
        from matplotlib import pyplot

        PICTURES.mkdir(parents=True, exist_ok=True)
        figure, axes = pyplot.subplots(figsize=(6, 3.6), dpi=90)
        draw(axes)
        axes.grid(alpha=0.3)
        figure.tight_layout()
        figure.savefig(PICTURES / f"{name}.png", metadata={"Software": None})
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
