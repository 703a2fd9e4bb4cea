"""The CSV tables of a run's folder (docs/DESIGN.md, section 8)."""

import csv
import struct


def rows(folder, table):
    """Header and rows of a table, as texts."""
    with open(folder / f"{table}.csv", newline="", encoding="utf-8") as file:
        header, *lines = csv.reader(file)
    return header, lines


def single(text):
    """The value of a 32-bit float."""
    return struct.unpack("<f", struct.pack("<f", float(text)))[0]
