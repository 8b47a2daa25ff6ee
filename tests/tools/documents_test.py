"""Links between the pages lead somewhere."""

import pathlib
import re
import unittest

SOURCE = pathlib.Path(__file__).resolve().parents[2]
PAGES = [SOURCE / "README.md", SOURCE / "CONTRIBUTING.md", *sorted((SOURCE / "docs").glob("**/*.md"))]


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

    def test_of_what_is_in_force_reach_every_record(self):
        records = {path.name for path in (SOURCE / "docs/decisions").glob("[0-9]*.md")}
        self.assertEqual(set(re.findall(r"\((\d+-[^)]+)\)", (SOURCE / "docs/decisions/in-force.md").read_text())), records)


if __name__ == "__main__":
    unittest.main()
