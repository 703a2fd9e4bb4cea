"""Reads the tables of a run, a sweep or a comparison."""

from __future__ import annotations

import csv
import importlib
import importlib.util
import io
import json
import os
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from . import _engine

#: Libraries for data frames. The first installed one is the default.
FRAMES = ("pandas", "polars")


class Results(Mapping[str, Any]):
    """Tables of a folder by name, read at the first access: `results["events"]` or `results.events`.

    A run has `events`, `poses`, `mission`, `messages`, `motivations`, `allocation` and `ticks`, as far as it logged them. `t_ms` is the
    simulated time. A comparison has `results` (a row for each run), `cells`, `pairs` and others. A sweep has `results` and `summary`.
    """

    def __init__(self, folder: Path, frame: str) -> None:
        self.folder = folder
        self.frame = frame
        self._tables: dict[str, Any] = {}
        self._names = sorted(path.stem for path in folder.glob("*.csv"))

    @property
    def run(self) -> dict[str, Any]:
        """Content of run.json: the setup with all parameter values, and the result."""
        run: dict[str, Any] = json.loads((self.folder / "run.json").read_text())
        return run

    def __getitem__(self, name: str) -> Any:
        if name not in self._names:
            known = ", ".join(self._names)
            raise KeyError(f"{self.folder} has no table '{name}'; it has {known}")
        if name not in self._tables:
            self._tables[name] = read(self._text(f"{name}.csv"), self.frame)
        return self._tables[name]

    def _text(self, file_name: str) -> str:
        """Returns the text of a table. The tables of a compact log get the rows that follow from others."""
        run = self.folder / "run.json"
        if run.exists() and json.loads(run.read_text()).get("log") == "compact":
            text = _engine.full_table(self.folder, file_name)
            if text is not None:
                return text
        return (self.folder / file_name).read_text()

    def __getattr__(self, name: str) -> Any:
        if name.startswith("_"):
            raise AttributeError(name)
        try:
            return self[name]
        except KeyError as error:
            raise AttributeError(error.args[0]) from None

    def __iter__(self) -> Iterator[str]:
        return iter(self._names)

    def __len__(self) -> int:
        return len(self._names)

    def __repr__(self) -> str:
        return f"<Results of {self.folder}: {', '.join(self._names)}>"


def load(folder: str | os.PathLike[str], frame: str | None = None) -> Results:
    """Returns the tables of a run folder, a sweep or a comparison.

    `frame`: `pandas`, `polars`, or `numpy` for a dict of arrays by column; default: the first of these that is installed.
    """
    folder = Path(folder)
    if not any(folder.glob("*.csv")):
        raise FileNotFoundError(f"{folder}: there are no tables; name the folder of a run, a sweep or a comparison")
    if frame not in (None, "numpy", *FRAMES):
        raise ValueError(f"frame: there is no '{frame}'; use pandas, polars or numpy")
    return Results(folder, frame or next(filter(_is_installed, FRAMES), "numpy"))


def _is_installed(library: str) -> bool:
    return importlib.util.find_spec(library) is not None


#: Columns of names and other words, in runs, sweeps and comparisons. They stay texts, also if all of them look like numbers: a robot may
#: have the name "01". `name` and the others with a dot before them are the columns of scenario keys such as `robots.0.name`.
TEXTS = frozenset(
    "robot receiver sender target holder behavior_set task state kind subject reason detail delivery fate section hash build content "
    "allocator mission faults preset outcome metric first second hypothesis claim part "
    "name description scenario controller policy region known".split()
)


def is_text(name: str) -> bool:
    """Returns whether the column contains names or other words."""
    return name.rpartition(".")[2] in TEXTS


def read(text: str, frame: str) -> Any:
    """Reads one table up to its last complete line: a killed world leaves an incomplete one.

    An empty cell is an empty text in a column of texts, and a missing number in any other column, as in the Parquet export.
    """
    text = text[: text.rfind("\n") + 1]
    header, *rows = csv.reader(io.StringIO(text)) if frame == "numpy" else [next(csv.reader(io.StringIO(text)), [])]
    texts = [name for name in header if is_text(name)]
    if frame == "numpy":
        columns = zip(*rows, strict=True) if rows else ([] for _ in header)
        return {name: column(name, values) for name, values in zip(header, columns, strict=True)}
    library = importlib.import_module(frame)
    if frame == "polars":
        schema = dict.fromkeys(texts, library.String)
        table = library.read_csv(io.StringIO(text), infer_schema_length=None, schema_overrides=schema)
        # A column without any value contains numbers, as in the Parquet export.
        empty = [name for name in header if name not in texts and table[name].null_count() == table.height]
        return table.with_columns(library.col(texts).fill_null(""), library.col(empty).cast(library.Float64))
    # A robot or a state may have the name "none".
    missing = {name: [""] for name in header if name not in texts}
    types = dict.fromkeys(texts, str)
    table = library.read_csv(io.StringIO(text), dtype=types, keep_default_na=False, na_values=missing, low_memory=False)
    return table.astype({name: float for name in missing if table[name].isna().all()})


def column(name: str, values: Any) -> np.ndarray:
    """Converts a column to texts, integers, floats with NaN for empty cells, or booleans."""
    values = list(values)
    if not values or is_text(name):
        return np.array(values, dtype=str)
    if all(value in ("true", "false") for value in values):
        return np.array([value == "true" for value in values])
    try:
        return np.array([int(value) for value in values])
    except (ValueError, OverflowError):
        pass
    try:
        return np.array([float(value) if value else np.nan for value in values])
    except ValueError:
        return np.array(values)
