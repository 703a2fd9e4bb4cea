"""Writes the tables of the study of imperfect radio in docs/COMPARISON.md.

usage: python3 tests/python/radio_tables.py [FOLDER | --check]

FOLDER is the output of `alliance compare campaigns/radio.toml`. Its results are stored in tests/golden/radio. Without
FOLDER the tables are written from the stored results. --check compares the page with them and writes nothing.
"""

import csv
import sys
import textwrap
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
STORED = ROOT / "tests/golden/radio"
PAGE = ROOT / "docs/COMPARISON.md"
BEGIN, END = "<!-- radio study -->\n", "<!-- end -->\n"

METRICS = ["par2_s", "completion", "distance_m", "duplicate_s", "bytes"]
CELLS = ["mission", "faults", "allocator", "metric", "n", "mean", "mean_from", "mean_to"]
PARTS = ["hypothesis", "outcome", "mission", "faults", "claim", "mean", "mean_from", "mean_to", "part"]


def read(path):
    with path.open(newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


def short(text):
    """Returns a number with six significant digits, and other texts as they are."""
    try:
        return f"{float(text):.6g}"
    except ValueError:
        return text


def store(folder):
    """Stores the columns and the metrics of a comparison that the page uses."""
    STORED.mkdir(parents=True, exist_ok=True)
    cells = [row for row in read(folder / "cells.csv") if row["metric"] in METRICS]
    for name, columns, rows in [("cells", CELLS, cells), ("hypotheses", PARTS, read(folder / "hypotheses.csv"))]:
        with (STORED / f"{name}.csv").open("w", newline="", encoding="utf-8") as file:
            table = csv.writer(file, lineterminator="\n")
            table.writerow(columns)
            table.writerows([short(row[column]) for column in columns] for row in rows)


def ordered(rows, column):
    """Returns the values of a column in the order of their first appearance."""
    return list(dict.fromkeys(row[column] for row in rows))


def grid(cells, mission, metric, show, best):
    """Returns a table with a line per channel and a column per rule. `best` selects the value in bold."""
    chosen = [row for row in cells if (row["mission"], row["metric"]) == (mission, metric)]
    values = {(row["faults"], row["allocator"]): float(row["mean"]) for row in chosen if row["mean"]}
    rules = ordered(chosen, "allocator")
    lines = ["| channel | " + " | ".join(f"`{rule}`" for rule in rules) + " |", "|---|" + "--:|" * len(rules)]
    for channel in ordered(chosen, "faults"):
        found = [values.get((channel, rule)) for rule in rules]
        texts = ["–" if value is None else show(value) for value in found]
        goal = best and show(best(value for value in found if value is not None))
        texts = [f"**{text}**" if text == goal else text for text in texts]
        lines.append(f"| `{channel}` | " + " | ".join(texts) + " |")
    return "\n".join(lines)


def verdicts(parts):
    """Returns the table of the hypotheses: the outcome, and of how many parts each claim held or failed."""
    lines = ["| hypothesis | outcome | parts | held | failed | means |", "|---|---|--:|--:|--:|---|"]
    for name in ordered(parts, "hypothesis"):
        own = [row for row in parts if row["hypothesis"] == name]
        count = {outcome: sum(row["part"] == outcome for row in own) for outcome in ("held", "failed")}
        means = sorted(float(row["mean"]) for row in own if row["mean"])
        span = f"{means[0]:,.1f} to {means[-1]:,.1f}" if means else "–"
        lines.append(f"| `{name}` | {own[0]['outcome']} | {len(own)} | {count['held']} | {count['failed']} | {span} |")
    return "\n".join(lines)


def paragraph(text):
    return textwrap.fill(" ".join(text.split()), 120, break_long_words=False, break_on_hyphens=False)


def tables():
    cells, parts = read(STORED / "cells.csv"), read(STORED / "hypotheses.csv")
    seeds = max(int(row["n"]) for row in cells)
    blocks = []
    for mission in ordered(cells, "mission"):
        blocks += [
            paragraph(f"""**`{mission}`: PAR2 in s**, mean of {seeds} seeds. An incomplete run counts 1,200 s. Bold: the
            least."""),
            grid(cells, mission, "par2_s", lambda value: f"{value:.1f}", min),
            f"**`{mission}`: share of complete runs, %**",
            grid(cells, mission, "completion", lambda value: f"{100 * value:.0f}", None),
            f"**`{mission}`: robot-seconds with two robots at a point for one** (`duplicate_s`)",
            grid(cells, mission, "duplicate_s", lambda value: f"{value:.1f}", None),
            f"**`{mission}`: sent data, kB**",
            grid(cells, mission, "bytes", lambda value: f"{value / 1000:,.0f}", None),
        ]
    blocks += [
        paragraph("""**Hypotheses.** A part is the claim for one channel and one rule, or one pair of rules. The means are
        those of the parts: of an `order`, the metric of the later rule less that of the earlier one, and of the others the
        difference to the channel that the plan names."""),
        verdicts(parts),
    ]
    return "\n\n".join(blocks) + "\n"


def main():
    arguments = sys.argv[1:]
    if len(arguments) > 1:
        sys.exit(__doc__)
    is_check = arguments == ["--check"]
    if arguments and not is_check:
        store(Path(arguments[0]))
    text = PAGE.read_text(encoding="utf-8")
    if BEGIN not in text or END not in text.partition(BEGIN)[2]:
        sys.exit(f"{PAGE}: there are no lines {BEGIN.strip()} and {END.strip()}")
    head, _, rest = text.partition(BEGIN)
    page = head + BEGIN + "\n" + tables() + "\n" + END + rest.partition(END)[2]
    if not is_check:
        PAGE.write_text(page, encoding="utf-8")
    elif page != text:
        sys.exit(f"{PAGE}: the tables differ from {STORED}; run this command without --check")


main()
