"""Values of a scenario in a dict, as JSON can write them."""

from __future__ import annotations

import math
import operator
import os
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from ._engine import ScenarioError


def shown(value: Any) -> str:
    """Returns a value for an error message: its `repr` in one line of at most 80 characters."""
    try:
        text = " ".join(repr(value).split())
    except Exception:
        text = object.__repr__(value)
    return text if len(text) <= 80 else f"{text[:79]}…"


def whole(value: Any, name: str, least: int, most: int = 2**63 - 1) -> int:
    """Returns a whole number, also of NumPy. Raises `ScenarioError` with the name of the argument for any other value."""
    try:
        number = operator.index(value)
    except TypeError:
        raise ScenarioError(f"{name}: {shown(value)} is not a whole number") from None
    if not least <= number <= most:
        limits = f"from {least} to {most}" if number > most else f"at least {least}"
        raise ScenarioError(f"{name}: {shown(number)} is out of range; it must be {limits}")
    return number


def seconds(value: Any, name: str) -> float:
    """Returns a positive number of seconds, also of NumPy. Raises `ScenarioError` with the name of the argument for any other value."""
    try:
        number = math.nan if isinstance(value, str | bytes | bool | np.bool_) else float(value)
    except (TypeError, ValueError, OverflowError):
        number = math.nan
    if not 0.0 < number < math.inf:
        raise ScenarioError(f"{name}: {shown(value)} is not a positive number of seconds")
    return number


def flag(value: Any, name: str) -> bool:
    """Returns a boolean, also of NumPy. Raises `ScenarioError` with the name of the argument for any other value."""
    if not isinstance(value, bool | np.bool_):
        raise ScenarioError(f"{name}: {shown(value)} is neither True nor False")
    return bool(value)


def text(value: Any, name: str) -> str:
    """Returns a text that can be encoded. Raises `ScenarioError` with the name of the argument for any other value."""
    if not isinstance(value, str):
        raise ScenarioError(f"{name}: {shown(value)} is not a text")
    try:
        value.encode()
    except UnicodeEncodeError:
        raise ScenarioError(f"{name}: the text {shown(value)} contains a character that UTF-8 cannot encode") from None
    return str(value)


def items(value: Any, name: str, form: str) -> list[Any]:
    """Returns the items of a list or of another iterable. Raises `ScenarioError` with the name of the argument and the right form otherwise."""
    if isinstance(value, str | bytes) or not isinstance(value, Iterable):
        raise ScenarioError(f"{name}: {shown(value)} is not {form}")
    return list(value)


def path(value: Any, name: str) -> Path:
    """Returns a path. Raises `ScenarioError` with the name of the argument for any other value."""
    try:
        return Path(value)
    except TypeError:
        raise ScenarioError(f"{name}: {shown(value)} is not the path of a file or folder") from None


def plain(value: Any, at: str) -> Any:
    """Returns a value of a scenario as JSON can write it. NumPy's numbers, texts and arrays become Python's.

    Raises `ScenarioError` with the key of a value that a scenario cannot contain.
    """
    if isinstance(value, np.ndarray):
        value = value.tolist()
    elif isinstance(value, np.generic):
        value = value.item()
    if isinstance(value, Mapping):
        for key in value:
            if not isinstance(key, str):
                raise ScenarioError(f"{at}: the key {shown(key)} is not a text; write the keys as texts")
            text(key, at)
        return {str(key): plain(below, f"{at}.{key}") for key, below in value.items()}
    if isinstance(value, list | tuple):
        return [plain(below, f"{at}[{index}]") for index, below in enumerate(value)]
    if isinstance(value, bool):
        return value
    if isinstance(value, str):
        return text(value, at)
    if isinstance(value, int):
        if not -(2**63) <= value < 2**63:
            raise ScenarioError(f"{at}: {shown(value)} is out of range; write a number from -2^63 to 2^63 - 1")
        return value
    if isinstance(value, float):
        if not math.isfinite(value):
            raise ScenarioError(f"{at}: {value} is not a finite number; write one, or omit the key")
        return value
    if isinstance(value, os.PathLike):
        return plain(os.fspath(value), at)
    if value is None:
        raise ScenarioError(f"{at}: None is not a value; omit the key")
    raise ScenarioError(f"{at}: a value of type {type(value).__name__} does not fit; write a number, a text, a list or a dict")
