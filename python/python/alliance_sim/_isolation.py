"""Isolation of the robots of one process: a read-only setup, and a check for variables that several robots would share.

Robots in processes have no common memory. In one process, a variable of a class or a module would be a radio without loss or delay.
"""

from __future__ import annotations

import builtins
import dis
import io
import pickle
import sys
import sysconfig
from collections.abc import Callable, Iterable, Iterator, Mapping
from functools import partial
from pathlib import Path
from types import CodeType, FunctionType, ModuleType
from typing import Any, NoReturn

from ._controllers import is_same

#: Length of a pickled value, bytes, above which only some of the steps compare it.
LARGE = 4096

#: Number of steps between two comparisons of a large value. The first steps compare it more often.
LARGE_STEPS = 256

#: Folders of the standard library, of installed packages and of this package. Their variables are not checked.
LIBRARIES = {Path(sysconfig.get_path(name)).resolve() for name in ("stdlib", "platstdlib", "purelib", "platlib")} | {Path(__file__).resolve().parent}

#: Types whose values cannot change.
CONSTANT = (bool, bytes, complex, float, int, str, type(None), type(...))

#: Instruction that assigns a global variable.
STORE_GLOBAL = dis.opmap["STORE_GLOBAL"]

#: Instruction that imports a module.
IMPORT_NAME = dis.opmap["IMPORT_NAME"]

#: Remedy for a shared variable.
KEEP = "Keep it in self, or name it in `collected` if no step reads it"

#: Value of a variable that does not exist.
MISSING = object()


def _refuse(*_: Any, **__: Any) -> NoReturn:
    raise TypeError("self.setup is read-only, because all robots have the same; copy.deepcopy(…) of a part can be changed")


class ReadOnlyDict(dict[str, Any]):
    """Part of the setup. `copy.deepcopy` returns an ordinary dict."""

    __setitem__ = __delitem__ = __ior__ = clear = pop = popitem = setdefault = update = _refuse

    def __reduce_ex__(self, _: Any) -> Any:
        return dict, (dict(self),)


class ReadOnlyList(list[Any]):
    """Part of the setup. `copy.deepcopy` returns an ordinary list."""

    __setitem__ = __delitem__ = __iadd__ = __imul__ = append = clear = extend = insert = pop = remove = reverse = sort = _refuse

    def __reduce_ex__(self, _: Any) -> Any:
        return list, (list(self),)


def read_only(value: Any) -> Any:
    """Returns a value of JSON whose dicts and lists cannot be changed."""
    if isinstance(value, dict):
        return ReadOnlyDict({key: read_only(below) for key, below in value.items()})
    if isinstance(value, list):
        return ReadOnlyList(map(read_only, value))
    return value


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

    def _added(self) -> str:
        names = () if len(self._attributes) == self._count else self._attributes
        return " ".join(name for name in names if not _is_special(name) and name not in self._known)

    def left(self) -> list[Variable]:
        names = self._added().split()
        return [Variable(f"{self._holder}.{name}", partial(self._attributes.get, name, MISSING), self.owner) for name in names]


#: Variables that a run of this process has left changed, by name and owner: with the value of its start, and with the one that it has
#: left. A later run must not start with the latter.
left_behind: dict[tuple[str, int], tuple[Variable, Variable]] = {}


class SharedVariables:
    """Variables that the methods of a controller class can reach, and that all its robots in a process would share."""

    def __init__(self, controller: type) -> None:
        self._search = Search(controller)
        self._variables: list[Variable] = []
        #: Names of variables that have the values which an earlier run has left.
        self._used: list[str] = []
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
                    self._used.append(variable.name)

    def _compare(self, *, with_large: bool) -> None:
        for name in self._used:
            raise RuntimeError(f"{name} was changed by an earlier run of this process: set it to its first value, or start Python again. {KEEP}")
        for variable in self._variables:
            if (with_large or not variable.is_large) and variable.has_changed():
                self._note_left()
                raise RuntimeError(f"{variable.name} was changed, which all robots of this process share; robots in processes do not. {KEEP}")

    def _note_left(self) -> None:
        for first in self._variables:
            for left in first.left() if first.has_changed() else ():
                left_behind[left.name, id(left.owner)] = (first, left)


def is_own(file: Path) -> bool:
    """Returns whether the author of the controller wrote a file."""
    return not LIBRARIES & set(file.resolve().parents)


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


class Search:
    """Search for the variables that the methods of a class can reach."""

    def __init__(self, controller: type) -> None:
        self._exempt = frozenset(getattr(controller, "collected", ()))
        self._package = controller.__module__.partition(".")[0]
        self._pending: list[Iterator[Variable]] = []
        self._visited: set[Any] = set()
        self._found: set[tuple[str, int]] = set()
        #: Modules that a function imports and that were not imported yet, with the names that the function uses.
        self._absent: list[tuple[str, tuple[str, ...]]] = []
        self._follow(controller, ())

    def variables(self) -> list[Variable]:
        """Returns the variables that no earlier call returned, in a fixed order: the first time all, and later those of modules
        that have been imported since.
        """
        absent, self._absent = self._absent, []
        for module, names in absent:
            self._follow_import(module, names)
        found: list[Variable] = []
        while self._pending:
            for variable in self._pending.pop():
                key = (variable.name, id(variable.owner))
                if key not in self._found:
                    self._found.add(key)
                    found.append(variable)
        return found

    def _follow(self, value: Any, names: tuple[str, ...]) -> bool:
        """Adds the variables of a class, a function or a module to the search. Returns false for any other value."""
        wrapped = getattr(value, "__wrapped__", None) if callable(value) else None
        if wrapped is not None:
            self._follow(wrapped, names)
        if isinstance(value, property):
            return any([self._follow(function, names) for function in (value.fget, value.fset, value.fdel)])
        value = value.__func__ if isinstance(value, staticmethod | classmethod) else value
        if not isinstance(value, type | FunctionType | ModuleType):
            return callable(value) and (wrapped is not None or not hasattr(value, "__dict__"))
        if isinstance(value, ModuleType):
            if self._is_own(value.__name__) and (id(value), names) not in self._visited:
                self._visited.add((id(value), names))
                self._pending.append(self._of_namespace(vars(value), value.__name__, names))
        elif id(value) not in self._visited and self._is_own(_module_of(value)):
            self._visited.add(id(value))
            self._pending.append(self._of_class(value) if isinstance(value, type) else self._of_function(value))
        return True

    def _is_own(self, module: str | None) -> bool:
        """Returns whether the author of the controller wrote a module."""
        if module is None or module == "builtins":
            return False
        if module.partition(".")[0] == self._package:
            return True
        file = getattr(sys.modules.get(module), "__file__", None)
        return file is not None and is_own(Path(file))

    def _variable(self, name: str, read: Callable[[], Any], owner: object, names: tuple[str, ...] = ()) -> Iterator[Variable]:
        """Yields a variable, unless its value leads to others."""
        value = read()
        if name.rpartition(".")[2] not in self._exempt and not self._follow(value, names):
            self._follow(type(value), ())
            yield Variable(name, read, owner)

    def _of_attributes(self, owner: type | FunctionType, name: str, own: Iterable[str]) -> Iterator[Variable]:
        """Yields these attributes of a class or a function, and a variable with the names of attributes that it gets later."""
        attributes = vars(owner)
        for attribute in own:
            yield from self._variable(f"{name}.{attribute}", partial(attributes.get, attribute, MISSING), owner)
        yield NewAttributes(name, owner, self._exempt)

    def _of_class(self, kind: type) -> Iterator[Variable]:
        for base in (type(kind), *kind.__mro__[1:]):
            self._follow(base, ())
        own = [name for name in vars(kind) if not _is_special(name) or isinstance(vars(kind)[name], FunctionType)]
        yield from self._of_attributes(kind, kind.__name__, own)

    def _of_function(self, function: FunctionType) -> Iterator[Variable]:
        code = function.__code__
        names = _names(code)
        yield from self._of_attributes(function, function.__qualname__, [name for name in vars(function) if not _is_special(name)])
        for name, cell in zip(code.co_freevars, function.__closure__ or (), strict=True):
            if not _is_special(name):
                yield from self._variable(f"{function.__qualname__}.{name}", partial(_content_of, cell), cell, names)
        given = dict(zip(reversed(code.co_varnames[: code.co_argcount]), reversed(function.__defaults__ or ()), strict=False))
        for name, default in {**given, **(function.__kwdefaults__ or {})}.items():
            yield from self._variable(f"{function.__qualname__}.{name}", partial(_identity, default), function, names)
        for module in _imports(code, function.__globals__.get("__package__") or ""):
            self._follow_import(module, names)
        yield from self._of_namespace(function.__globals__, function.__globals__["__name__"], names, _stores_globals(code))

    def _follow_import(self, module: str, names: tuple[str, ...]) -> None:
        if module in sys.modules:
            self._follow(sys.modules[module], names)
        else:
            self._absent.append((module, names))

    def _of_namespace(self, namespace: Mapping[str, Any], module: str, names: tuple[str, ...], with_new: bool = False) -> Iterator[Variable]:
        """Yields the variables of these names. `with_new`: also those that do not exist yet."""
        for name in names:
            if name in namespace or (with_new and not hasattr(builtins, name)):
                yield from self._variable(f"{module}.{name}", partial(namespace.get, name, MISSING), namespace, names)


def _identity(value: Any) -> Any:
    return value


def _is_special(name: str) -> bool:
    return name.startswith("__") and name.endswith("__")


def _module_of(value: type | FunctionType) -> str | None:
    """Returns the module with the code of a class or a function. `functools.wraps` changes only `__module__`."""
    return value.__globals__.get("__name__") if isinstance(value, FunctionType) else value.__module__


def _imports(code: CodeType, package: str) -> Iterator[str]:
    """Yields the modules that a function of a package, or a function in it, can import."""
    for instruction in dis.get_instructions(code):
        if instruction.opcode == IMPORT_NAME:
            name = str(instruction.argval)
            yield from filter(None, (name, name.partition(".")[0]))
            if package:
                yield f"{package}.{name}".removesuffix(".")
    for constant in code.co_consts:
        if isinstance(constant, CodeType):
            yield from _imports(constant, package)


def _content_of(cell: Any) -> Any:
    try:
        return cell.cell_contents
    except ValueError:  # The variable has no value yet.
        return MISSING


def _stores_globals(code: CodeType) -> bool:
    """Returns whether a function, or one in it, assigns a global variable."""
    return STORE_GLOBAL in code.co_code[::2] or any(_stores_globals(constant) for constant in code.co_consts if isinstance(constant, CodeType))


def _names(code: CodeType) -> tuple[str, ...]:
    """Returns the names of globals and attributes that a function uses, with those of the functions in it."""
    inner = (name for constant in code.co_consts if isinstance(constant, CodeType) for name in _names(constant))
    return tuple(dict.fromkeys((*code.co_names, *inner)))
