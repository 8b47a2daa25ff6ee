"""What Prometheus and Grafana are told to ask for exists."""

import pathlib
import re
import unittest

SOURCE = pathlib.Path(__file__).resolve().parents[2]


class Operations(unittest.TestCase):
    def test_alerts_and_dashboard_ask_for_metrics_that_exist(self):
        families = re.findall(r'name: "([a-z_]+)" kind: KIND_([A-Z]+)',
                              (SOURCE / "proto/traction/v1/status.proto").read_text())
        known = {"traction_up", "traction_info", "traction_health"}
        known |= {"traction_" + name for name, kind in families if kind != "HISTOGRAM"}
        known |= {f"traction_{name}_{part}" for name, kind in families if kind == "HISTOGRAM"
                  for part in ("bucket", "sum", "count")}
        dashboard = (SOURCE / "config/grafana/tractiond.json").read_text()
        for text in ((SOURCE / "config/prometheus/alerts.yml").read_text(), dashboard):
            asked = set(re.findall(r"\btraction_[a-z_]+", text))
            self.assertTrue(asked)
            self.assertLessEqual(asked, known)
