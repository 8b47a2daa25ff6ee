"""Links between the pages, and from the code to pages, lead somewhere; lists in the pages are those of records and code."""

import os
import pathlib
import re
import unittest

SOURCE = pathlib.Path(__file__).resolve().parents[2]
RECORDS = sorted((SOURCE / "docs/decisions").glob("[0-9]*.md"))
PAGES = [SOURCE / "README.md", *sorted((SOURCE / "docs").glob("**/*.md"))]
SECTIONS = ["Status", "Context", "Decision", "Alternatives", "Measured", "Limits"]
CODE = ("base", "client", "config", "daemon", "debian", "gateway", "lens", "manual", "proto", "recording", "sensor", "tests",
        "tools", "touch", "twin")


def anchors(page):
    """Returns the anchors of a page's headings as GitHub derives them: lower case, punctuation dropped, spaces to hyphens."""
    text = re.sub(r"^```.*?^```", "", page.read_text(), flags=re.M | re.S)
    titles = re.findall(r"^#+ (.*)", text, re.M)
    return {re.sub(r"[^\w\- ]", "", title.lower()).replace(" ", "-") for title in titles}


def sections(record):
    return re.findall(r"^## (.*)", record.read_text(), re.M)


class Links(unittest.TestCase):
    def test_of_pages_lead_to_files_and_headings(self):
        count = 0
        for page in PAGES:
            for place in re.findall(r"\]\(([^)\s]+)\)", page.read_text()):
                if re.match(r"[a-z]+:", place):
                    continue
                count += 1
                name, _, anchor = place.partition("#")
                target = page.parent / name if name else page
                with self.subTest(page=page.name, link=place):
                    self.assertTrue(target.exists())
                    if anchor:
                        self.assertIn(anchor, anchors(target))
        self.assertGreater(count, 150)

    def test_of_code_lead_to_pages(self):
        count = 0
        for path in (path for room in CODE for path in (SOURCE / room).rglob("*")):
            if path.suffix not in (".h", ".cpp", ".py", ".js", ".proto", ".toml", ".txt", ".yml", "") or not path.is_file():
                continue
            if "node_modules" in path.parts:
                continue
            text = path.read_text(errors="replace")
            for name in re.findall(r"(?<![\w/.])(?<!ws-protocol, )docs/[a-z0-9_/-]+\.md", text):
                count += 1
                with self.subTest(path=str(path.relative_to(SOURCE)), page=name):
                    self.assertTrue((SOURCE / name).exists())
        self.assertGreater(count, 50)


class Decisions(unittest.TestCase):
    def test_index_lists_every_record_with_its_title_and_status(self):
        index = (SOURCE / "docs/decisions/README.md").read_text()
        listed = re.findall(r"^\| \[(\d+)\]\(([^)]+)\) \| ([^|]*) \| ([^|]+) \| ([^|]+) \|$", index, re.M)
        expected = []
        for record in RECORDS:
            title = re.match(r"# (\d+)\. (.*)\n", record.read_text())
            self.assertEqual(int(title[1]), int(record.name[:4]))
            status = re.search(r"^## Status\n\n(.*?)\.", record.read_text(), re.M)
            expected.append((title[1], record.name, title[2], status[1].lower() if status else "in force"))
        self.assertEqual([(number, name, title, status) for number, name, title, _, status in listed], expected)

    def test_records_have_the_sections_of_the_format_in_its_order(self):
        self.assertEqual([title for title in re.findall(r"^\| ([A-Z]\w+) \| ", (SOURCE / "docs/decisions/README.md").read_text(),
                                                        re.M)], SECTIONS)
        for record in RECORDS:
            with self.subTest(record=record.name):
                found = sections(record)
                self.assertEqual(found, [name for name in SECTIONS if name in found])
                self.assertLessEqual({"Context", "Decision"}, set(found))


class Architecture(unittest.TestCase):
    def test_lists_the_exit_codes_of_the_daemon(self):
        code = "".join(path.read_text() for room in ("base", "daemon") for path in (SOURCE / room).rglob("*")
                       if path.suffix in (".h", ".cpp"))
        used = {getattr(os, name) for name in re.findall(r"\bEX_[A-Z]+\b", code)}
        errors = re.search(r"^## Errors\n(.*?)^## ", (SOURCE / "docs/architecture.md").read_text(), re.M | re.S)[1]
        self.assertEqual(used, {int(number) for number in re.findall(r"^\| (\d+) \|", errors, re.M)})


if __name__ == "__main__":
    unittest.main()
