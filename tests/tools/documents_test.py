"""Links between the pages, and from the code to pages, lead somewhere."""

import pathlib
import re
import unittest

SOURCE = pathlib.Path(__file__).resolve().parents[2]
PAGES = [SOURCE / "README.md", SOURCE / "CONTRIBUTING.md", *sorted((SOURCE / "docs").glob("**/*.md"))]
CODE = ("base", "client", "config", "daemon", "debian", "gateway", "lens", "manual", "proto", "recording", "sensor", "tests",
        "tools", "touch", "twin")


def anchors(page):
    """Returns the anchors of a page's headings as GitHub derives them: lower case, punctuation dropped, spaces to hyphens."""
    text = re.sub(r"^```.*?^```", "", page.read_text(), flags=re.M | re.S)
    titles = re.findall(r"^#+ (.*)", text, re.M)
    return {re.sub(r"[^\w\- ]", "", title.lower()).replace(" ", "-") for title in titles}


class Links(unittest.TestCase):
    def test_of_pages_lead_to_files_and_headings(self):
        for page in PAGES:
            for place in re.findall(r"\]\(([^)\s]+)\)", page.read_text()):
                if re.match(r"[a-z]+:", place):
                    continue
                name, _, anchor = place.partition("#")
                target = page.parent / name if name else page
                with self.subTest(page=page.name, link=place):
                    self.assertTrue(target.exists())
                    if anchor:
                        self.assertIn(anchor, anchors(target))

    def test_of_code_lead_to_pages(self):
        for path in (path for room in CODE for path in (SOURCE / room).rglob("*")):
            if path.suffix not in (".h", ".cpp", ".py", ".js", ".proto", ".toml", ".txt", ".yml", "") or not path.is_file():
                continue
            if "node_modules" in path.parts:
                continue
            text = path.read_text(errors="replace")
            for name in re.findall(r"(?<![\w/.])(?<!ws-protocol, )docs/[a-z0-9_/-]+\.md", text):
                with self.subTest(path=str(path.relative_to(SOURCE)), page=name):
                    self.assertTrue((SOURCE / name).exists())


if __name__ == "__main__":
    unittest.main()
