"""Links between the pages lead somewhere; what the pages say of themselves is so."""

import pathlib
import re
import unittest

SOURCE = pathlib.Path(__file__).resolve().parents[2]
PAGES = [SOURCE / "README.md", SOURCE / "CONTRIBUTING.md", *sorted((SOURCE / "docs").glob("**/*.md"))]


def anchor_of(title):
    """Returns the anchor of a heading as GitHub derives it: lower case, punctuation dropped, spaces to hyphens."""
    return re.sub(r"[^\w\- ]", "", title.lower()).replace(" ", "-")


def anchors(page):
    """Returns the anchors of a page's headings."""
    text = re.sub(r"^```.*?^```", "", page.read_text(), flags=re.M | re.S)
    titles = re.findall(r"^#+ (.*)", text, re.M)
    return set(map(anchor_of, titles))


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

    def test_of_what_is_in_force_reach_every_record(self):
        records = {path.name for path in (SOURCE / "docs/decisions").glob("[0-9]*.md")}
        self.assertEqual(set(re.findall(r"\((\d+-[^)]+)\)", (SOURCE / "docs/decisions/in-force.md").read_text())), records)


class Accuracy(unittest.TestCase):
    def test_sections_name_commit_seed_date_and_sources(self):
        for section in re.split(r"\n## ", (SOURCE / "docs/accuracy.md").read_text())[2:]:
            with self.subTest(section=section.partition("\n")[0]):
                origin = re.search(r"^`tools/evaluate .*--only \w+.*`: commit [0-9a-f]{8}( with changes)?, seed (\d+|fixed|not kept), "
                                   r"\d{4}-\d\d-\d\d; sources (`.*`)$", section, re.M)
                self.assertTrue(origin)
                for path in re.findall(r"`(.+?)`", origin[3]):
                    self.assertTrue((SOURCE / path).exists(), path)

    def test_what_is_missed_is_what_the_head_of_the_page_lists(self):
        head, *sections = re.split(r"\n## ", (SOURCE / "docs/accuracy.md").read_text())[1:]
        missed = {anchor_of(part.partition("\n")[0]) for part in sections if "| MISSED |" in part}
        self.assertEqual(set(re.findall(r"\(#([^)]+)\)", head)), missed)


if __name__ == "__main__":
    unittest.main()
