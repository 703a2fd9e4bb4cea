"""Variables outside the controllers, compared by content with their values at the start of a run."""

from __future__ import annotations

import io
import pickle
from collections.abc import Callable
from functools import partial
from types import FunctionType, ModuleType
from typing import Any

from ._controllers import is_same

#: Length of a pickled value, bytes, above which only some of the steps compare it.
LARGE = 4096

#: Types whose values cannot change.
CONSTANT = (bool, bytes, complex, float, int, str, type(None), type(...))

#: Value of a variable that does not exist.
MISSING = object()


class Variable:
    """Variable outside the controllers, with its value at the start of a run."""

    def __init__(self, name: str, read: Callable[[], Any], owner: object) -> None:
        """`owner`: the object that contains the variable. Two variables of a name differ in it."""
        self.name = name
        self.owner = owner
        self._read = read
        self._value = read()
        has_content = not isinstance(self._value, CONSTANT) and self._value is not MISSING
        self._bytes = _pickled(self._value) if has_content else None
        #: Objects whose identities `_bytes` contains.
        self._kept: list[Any] | None = None
        if has_content and self._bytes is None:
            self._bytes, self._kept = _pickled_with_identities(self._value)
        self.is_large = self._bytes is not None and len(self._bytes) > LARGE

    def has_changed(self) -> bool:
        """Compares the variable with the start of the run."""
        now = self._read()
        if now is self._value:
            return not self._has_same_content(now)
        return not (isinstance(now, CONSTANT) and type(now) is type(self._value) and now == self._value)

    @property
    def was_missing(self) -> bool:
        """True if the variable did not exist at the start of the run."""
        return self._value is MISSING

    def changed_name(self) -> str:
        """Returns the name of what has changed."""
        return self.name

    def has_first_value(self) -> bool:
        """Compares the content of the variable with the start of the run. Unlike in `has_changed`, it may be another object."""
        now = self._read()
        return self._has_same_content(now) if self._bytes is not None and type(now) is type(self._value) else not self.has_changed()

    def _has_same_content(self, now: Any) -> bool:
        if self._bytes is None:
            return True
        content = _pickled(now) if self._kept is None else _pickled_with_identities(now)[0]
        if content == self._bytes:
            return True
        if content is None:
            return False
        # Equal values can have different bytes, for example if a text is stored twice.
        try:
            is_equal = is_same(pickle.loads(self._bytes), pickle.loads(content))
        except Exception:  # A foreign class may raise any error.
            return False
        if is_equal:
            self._bytes = content
        return is_equal

    def left(self) -> list[Variable]:
        """Returns the variables that a run leaves changed, with their present values."""
        return [Variable(self.name, self._read, self.owner)]


class NewAttributes(Variable):
    """Attributes that a class or a function gets during a run."""

    def __init__(self, holder: str, owner: type | FunctionType, exempt: frozenset[str]) -> None:
        self._holder = holder
        self._attributes = vars(owner)
        self._known, self._count = {*self._attributes, *exempt}, len(self._attributes)
        super().__init__(f"a new attribute of {holder}", self._added, owner)

    @property
    def was_missing(self) -> bool:
        return True

    def changed_name(self) -> str:
        return f"{self._holder}.{self._added().partition(' ')[0]}"

    def _added(self) -> str:
        names = () if len(self._attributes) == self._count else self._attributes
        return " ".join(name for name in names if not is_special(name) and name not in self._known)

    def left(self) -> list[Variable]:
        names = self._added().split()
        return [Variable(f"{self._holder}.{name}", partial(self._attributes.get, name, MISSING), self.owner) for name in names]


def is_special(name: str) -> bool:
    return name.startswith("__") and name.endswith("__")


def _pickled(value: Any) -> bytes | None:
    try:
        return pickle.dumps(value, pickle.HIGHEST_PROTOCOL)
    except Exception:  # A foreign class may raise any error.
        return None


def _pickled_with_identities(value: Any) -> tuple[bytes | None, list[Any]]:
    """Returns a value as bytes with the identities of the objects in it that cannot be pickled, and these objects."""
    file = io.BytesIO()
    pickler = IdentityPickler(file, pickle.HIGHEST_PROTOCOL)
    try:
        pickler.dump(value)
    except Exception:  # A foreign class may raise any error.
        return None, []
    return file.getvalue(), pickler.kept


class Identity:
    """Stands for an object that cannot be pickled."""

    def __init__(self, number: int, attributes: Any) -> None:
        self._content = (number, attributes)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Identity) and is_same(self._content, other._content)

    def __hash__(self) -> int:
        return hash(self._content[0])

    def __call__(self) -> None:
        """Stands for a function, such as that of a defaultdict."""


class IdentityPickler(pickle.Pickler):
    """Pickler that writes the identity of each object that cannot be pickled."""

    def __init__(self, *given: Any) -> None:
        super().__init__(*given)
        #: These objects. They must live as long as the bytes, so that no other object gets their identity.
        self.kept: list[Any] = []

    def reducer_override(self, value: Any) -> Any:
        attributes = None
        if isinstance(value, type | FunctionType | ModuleType):
            if _pickled(value) is not None:
                return NotImplemented
        else:
            try:
                reduced = value.__reduce_ex__(pickle.HIGHEST_PROTOCOL)
                if not isinstance(reduced, str) or _pickled(value) is not None:
                    return NotImplemented
            except Exception:  # A foreign class may raise any error.
                attributes = getattr(value, "__dict__", None)
        self.kept.append(value)
        return Identity, (id(value), attributes)
