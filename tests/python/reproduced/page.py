"""The page docs/REPRODUCED.md, from the figures."""

import textwrap
from collections import Counter, namedtuple

# A result: its name, the published figure, the figure here, the verdict and the reason.
Row = namedtuple("Row", "result published here verdict why")
# The results of one source: title, source, setting, rows and further text.
Section = namedtuple("Section", "title source setting rows more", defaults=[""])

REPRODUCED, FAILED, OTHER = "reproduced", "**not reproduced**", "not comparable"

HEAD = """\
# Results of others

For each published result: its source and setting, the published figure, the figure here, the verdict and the reason.
Nothing was tuned for this page, and results that differ stay on it. The verdict follows from the figures by a rule in
the code. *Not comparable* marks a result whose setting differs or is not known.

```sh
python3 tests/python/reproduced --program target/release/alliance --instances DIR
```

This command measures all figures, stores them in `tests/golden/reproduced.json` and writes this page. DIR contains
RC208.vrp, PR01.vrp and PR11A.vrp from the tests in PyVRP's sources. Names of sections (grape, cbba, space, routing,
thesis, teams) limit the command to these. With `--check`, it repeats a cheap part of each section and compares the
figures and the page; the test `reproduced` does so in CI. A section without its data or packages is skipped and named.
Code: `tests/python/reproduced/`.
"""


def verdict(holds):
    """Returns the verdict of a rule."""
    return REPRODUCED if holds else FAILED


def table(header, lines):
    """Returns a table in Markdown."""
    return "\n".join("| " + " | ".join(line) + " |" for line in [header, ["---"] * len(header), *lines])


def prose(text):
    """Returns a paragraph in lines of at most 120 characters."""
    return textwrap.fill(" ".join(text.split()), 120, break_long_words=False, break_on_hyphens=False)


def page(sections):
    """Returns the page."""
    counts = Counter(row.verdict for section in sections for row in section.rows)
    summary = ", ".join(f"{counts[each]} {each}" for each in (REPRODUCED, FAILED, OTHER))
    parts = [HEAD, prose(f"{sum(counts.values())} results: {summary}.") + "\n"]
    for section in sections:
        lines = [
            f"## {section.title}\n",
            prose(f"**Source.** {section.source}") + "\n",
            prose(f"**Setting.** {section.setting}") + "\n",
            table(["result", "published", "here", "verdict", "why"], section.rows) + "\n",
            *([section.more.strip() + "\n"] if section.more else []),
        ]
        parts += lines
    return "\n".join(parts)
