"""Isolation of the robots of one process: a check for variables that several robots would share.

Robots in processes have no common memory. In one process, a variable of a class or a module would be a radio without loss or delay.
"""

from __future__ import annotations

from ._controllers import Controller
from ._search import Search
from ._variable import Variable

#: Number of steps between two comparisons of a large value. The first steps compare it more often.
LARGE_STEPS = 256

#: Remedy for a shared variable.
KEEP = "Keep it in self, or name it in `collected` if no step reads it"

#: Variables that a run of this process has left changed, by name and owner: with the value of its start, and with the one that it has
#: left. A later run must not start with the latter.
left_behind: dict[tuple[str, int], tuple[Variable, Variable]] = {}


class SharedVariables:
    """Variables that the methods of a controller class can reach, and that all its robots in a process would share."""

    def __init__(self, controller: type[Controller]) -> None:
        self._search = Search(controller)
        self._variables: list[Variable] = []
        #: Variables that have the values which an earlier run has left: the name, and whether the run added it.
        self._used: list[tuple[str, bool]] = []
        self._add_found()
        self._steps = 0

    def check(self) -> None:
        """Raises a `RuntimeError` that names a variable which has changed since the start of the run."""
        self._steps += 1
        self._compare(with_large=self._steps % LARGE_STEPS == 0 or self._steps & (self._steps - 1) == 0)
        self._add_found()

    def check_all(self) -> None:
        """Raises the error of `check`, also for large values."""
        self._compare(with_large=True)

    def _add_found(self) -> None:
        for variable in self._search.variables():
            self._variables.append(variable)
            key = (variable.name, id(variable.owner))
            if key in left_behind:
                first, left = left_behind[key]
                if left.has_changed() or first.has_first_value():
                    del left_behind[key]
                else:
                    self._used.append((variable.name, first.was_missing))

    def _compare(self, *, with_large: bool) -> None:
        for name, was_missing in self._used:
            what, remedy = ("added", "delete it") if was_missing else ("changed", "set it to its first value")
            raise RuntimeError(f"{name} was {what} by an earlier run of this process: {remedy}, or start Python again. {KEEP}")
        for variable in self._variables:
            if (with_large or not variable.is_large) and variable.has_changed():
                self._note_left()
                what = f"{variable.changed_name()} was {'added' if variable.was_missing else 'changed'}"
                raise RuntimeError(f"{what}, which all robots of this process share; robots in processes do not. {KEEP}")

    def _note_left(self) -> None:
        for first in self._variables:
            for left in first.left() if first.has_changed() else ():
                left_behind[left.name, id(left.owner)] = (first, left)
