"""Every warning and error of the daemon and the gateway is explained in docs/operations.md, and what is explained there exists."""

import pathlib
import json
import re
import unittest

SOURCE = pathlib.Path(__file__).resolve().parents[2]
SAYS = re.compile(r"""spdlog::(?:warn|error)\( | warnings\.push_back\( | LogLevel::kWarning, | failed\(\s*EX_\w+\s*, |
                      \.what\s*= | Error\{\s*EX_\w+, | giveUp\( | EX_\w+\s*:\s*EX_\w+,""", re.X)
STRING = r'"((?:[^"\\]|\\.)*)"'
SHORTEST = 12  # letters that tell a message from others
# Words of other pages: what a calibration answers, what is passed on, what is no message.
ELSEWHERE = ("daemon/calibrate/calibration.cpp", "daemon/capture/camera_plan.cpp")


def plain(text):
    return re.sub(r"\s+", " ", text)


def statement(text, start):
    """From a place to the semicolon that ends it."""
    return re.match(rf'(?:{STRING}|[^";])*', text[start:])[0]


def fixed(text):
    """The first piece between what varies that tells it from others, or the longest."""
    pieces = [piece.strip(" :;,()") for piece in re.split(r"\{[^}]*\}|…", text)]
    return next((piece for piece in pieces if len(piece) >= SHORTEST), max(pieces, key=len))


def sources():
    return sorted(path for room in ("base", "daemon", "gateway") for path in (SOURCE / room).rglob("*.cpp"))


def messages():
    """(where, the longest fixed piece of the first part)."""
    for path in sources():
        if str(path.relative_to(SOURCE)) in ELSEWHERE:
            continue
        text = path.read_text()
        for match in SAYS.finditer(text):
            joined = re.sub(r'"\s*\n\s*"', "", statement(text, match.end()))
            pieces = [fixed(plain(piece).replace('\\"', '"').removeprefix("warning: "))
                      for piece in re.findall(STRING, joined)]
            pieces = [piece for piece in pieces if len(piece) >= SHORTEST]
            if pieces:
                line = text.count("\n", 0, match.start()) + 1
                yield f"{path.relative_to(SOURCE)}:{line}", pieces[0]


class Operations(unittest.TestCase):
    page = plain((SOURCE / "docs/operations.md").read_text())

    def test_every_message_is_explained(self):
        found = list(messages())
        self.assertGreater(len(found), 60)
        missing = [f"{where}: {piece}" for where, piece in found if piece not in self.page]
        self.assertEqual(missing, [], "\n" + "\n".join(missing))

    def test_alerts_and_dashboard_ask_for_metrics_that_exist(self):
        families = re.findall(r'name: "([a-z_]+)" kind: KIND_([A-Z]+)',
                              (SOURCE / "proto/traction/v1/status.proto").read_text())
        self.assertGreater(len(families), 20)
        known = {"traction_up", "traction_info", "traction_health"}
        known |= {"traction_" + name for name, kind in families if kind != "HISTOGRAM"}
        known |= {f"traction_{name}_{part}" for name, kind in families if kind == "HISTOGRAM"
                  for part in ("bucket", "sum", "count")}
        dashboard = (SOURCE / "config/grafana/tractiond.json").read_text()
        for text in ((SOURCE / "config/prometheus/alerts.yml").read_text(), dashboard):
            asked = set(re.findall(r"\btraction_[a-z_]+", text))
            self.assertGreater(len(asked), 8)
            self.assertLessEqual(asked, known)
        panels = json.loads(dashboard)["panels"]
        places = {(x, y) for panel in panels for grid in [panel["gridPos"]]
                  for x in range(grid["x"], grid["x"] + grid["w"]) for y in range(grid["y"], grid["y"] + grid["h"])}
        self.assertEqual(len(places), sum(panel["gridPos"]["w"] * panel["gridPos"]["h"] for panel in panels))  # none overlap
        self.assertEqual(len({panel["id"] for panel in panels}), len(panels))

    def test_what_is_explained_exists(self):
        code = plain(re.sub(r'"\s*\n\s*"', "", "\n".join(
            path.read_text() for path in sources()))).replace('\\"', '"')
        for row in re.findall(r"^\| (`.*?) \|", (SOURCE / "docs/operations.md").read_text(), re.M):
            for said in re.findall(r"`([^`]*)`", row):
                if re.match(r"[a-z_]+[.a-z_,]*$", said):
                    continue  # a number of the status
                self.assertTrue(fixed(said) in code, said)


if __name__ == "__main__":
    unittest.main()
