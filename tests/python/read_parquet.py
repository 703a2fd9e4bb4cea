"""Compares the Parquet tables of a run with its CSV tables, value by value. Prints the result as JSON.

    read_parquet.py FOLDER PARQUET-FOLDER
"""

import json
import sys
from pathlib import Path

import pandas
import pyarrow.parquet

from runlog import rows, single

INTEGER, TEXT, FLAG = "int64", "string", "bool"
FLAGS = {"0": False, "1": True}
COLUMNS = {
    "motivations": [INTEGER, TEXT, TEXT, TEXT, "double", "double", FLAG, FLAG, FLAG, FLAG, TEXT],
    "allocation": [INTEGER, TEXT, TEXT, TEXT, "double", TEXT, TEXT],
    "messages": [INTEGER, TEXT, TEXT, INTEGER, INTEGER, TEXT, TEXT, INTEGER, TEXT, TEXT, INTEGER, INTEGER, TEXT],
    "sent": [INTEGER, TEXT, INTEGER, INTEGER],
    "hits": [INTEGER, TEXT, INTEGER],
    "events": [INTEGER, TEXT, TEXT, TEXT, TEXT, TEXT],
    "poses": [INTEGER, TEXT, "float", "float", "float", "float", FLAG, TEXT, "float"],
    # The mission determines the number of columns.
    "mission": [INTEGER],
    "targets": [INTEGER, TEXT, "float", "float", INTEGER],
    "ticks": [INTEGER, INTEGER, TEXT, TEXT, TEXT],
}
VALUES = {INTEGER: int, TEXT: str, FLAG: FLAGS.__getitem__, "double": float, "float": single}


def equal(found, expected, where):
    if found != expected:
        sys.exit(f"{where}: {found!r} is not {expected!r}")


def compare(folder, path):
    table = pyarrow.parquet.read_table(path)
    header, lines = rows(folder, path.stem)
    equal(table.column_names, header, f"columns of {path.stem}")
    kinds = COLUMNS[path.stem]
    if path.stem == "mission":
        kinds = kinds * len(header)
    equal([str(kind) for kind in table.schema.types], kinds, f"types of {path.stem}")
    nulls = 0
    for index, (name, kind) in enumerate(zip(header, kinds)):
        expected = [None if kind != TEXT and line[index] == "" else VALUES[kind](line[index]) for line in lines]
        equal(table.column(name).to_pylist(), expected, f"{path.stem}.{name}")
        nulls += expected.count(None)
    # The same table in pandas.
    frame = pandas.read_parquet(path)
    equal(frame.shape, (len(lines), len(header)), f"{path.stem} in pandas")
    equal(int(frame.isna().sum().sum()), nulls, f"nulls of {path.stem} in pandas")
    file = pyarrow.parquet.ParquetFile(path)
    metadata = {key.decode(): value.decode() for key, value in file.schema_arrow.metadata.items()}
    return {"rows": len(lines), "nulls": nulls, "groups": file.num_row_groups, "metadata": metadata}


def main(folder, parquet):
    print(json.dumps({path.stem: compare(folder, path) for path in sorted(parquet.glob("*.parquet"))}))


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(sys.argv[2]))
