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
The verdict follows from the figures by a rule in the code. A result that differs is *not reproduced*. *Not comparable*
marks an agreement that proves little, because the setting differs or is not known, parameters were chosen here, or the
published result is quoted from memory.

```sh
python3 tests/python/reproduced --program target/release/alliance --data DATA --instances DIR \\
    --implementations CODE
```

This command measures all figures, stores them in `tests/golden/reproduced.json` and writes this page.

- DATA contains `grape/circle.csv`, `skew.csv` and `square.csv` (the instances of figure 7, with the columns kind,
  index, x_m, y_m, demand, task and utility), their links `circle-links.csv` and so on (columns a and b), and
  `space_runs.csv` (93 runs of SPACE, with the columns allocator, end_s and distance). The default is `../shared/data`,
  beside the repository.
- DIR contains RC101.txt, and RC208.vrp, PR01.vrp and PR11A.vrp from the tests in PyVRP's sources.
- CODE contains CBBA-Python and space-simulator, the sources of both repositories at the stated commits.
- Names of sections (grape, cbba, public, bounds, space, routing, thesis, teams) limit the command to these.
- With `--check`, it repeats a cheap part of each section and compares the figures and the page; the test `reproduced`
  does so in CI.
- A section without its data or packages is skipped and named. The page needs the packages of all sections.

Code: `tests/python/reproduced/`.
"""


def verdict(holds, is_known=True):
    """Returns the verdict of a rule. `is_known`: false if the published setting or result is not known exactly."""
    if not holds:
        return FAILED
    return REPRODUCED if is_known else OTHER


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
