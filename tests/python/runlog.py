"""The CSV tables of a run's folder (docs/GUARANTEES.md)."""

import csv
import struct


def rows(folder, table):
    """Returns the header and the rows of a table as texts."""
    with open(folder / f"{table}.csv", newline="", encoding="utf-8") as file:
        header, *lines = csv.reader(file)
    return header, lines


def single(text):
    """Parses a 32-bit float."""
    return struct.unpack("<f", struct.pack("<f", float(text)))[0]
