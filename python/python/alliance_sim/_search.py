"""Search for the variables that a controller class can reach, through its methods and the modules of its author."""

from __future__ import annotations

import builtins
import dis
import site
import sys
import sysconfig
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Mapping
from enum import EnumMeta
from functools import partial
from pathlib import Path
from types import CodeType, FunctionType, MethodType, ModuleType
from typing import Any, NamedTuple

from ._controllers import Controller, names_of
from ._variable import CONSTANT, MISSING, NewAttributes, Variable, is_special

#: Folders of the standard library, of installed packages and of this package. Their variables are not checked.
LIBRARIES = {Path(sysconfig.get_path(name)).resolve() for name in ("stdlib", "platstdlib", "purelib", "platlib")} | {
    Path(folder).resolve() for folder in (*site.getsitepackages(), site.getusersitepackages(), str(Path(__file__).parent))
}

#: Instructions that assign a global variable or an attribute.
STORES = {dis.opmap["STORE_GLOBAL"], dis.opmap["STORE_ATTR"]}

#: Instruction that imports a module.
IMPORT_NAME = dis.opmap["IMPORT_NAME"]

#: Containers whose elements are searched for functions and classes.
CONTAINERS = (list, tuple, set, frozenset, deque)


class Names(NamedTuple):
    """Names of globals and attributes in a function."""

    used: tuple[str, ...] = ()
    #: Those that it assigns.
    stored: frozenset[str] = frozenset()


class Search:
    """Search for the variables that the methods of a class can reach."""

    def __init__(self, controller: type[Controller]) -> None:
        self._exempt = names_of(controller, "collected")
        self._package = controller.__module__.partition(".")[0]
        self._pending: list[Iterator[Variable]] = []
        self._visited: set[Any] = set()
        self._found: set[tuple[str, int]] = set()
        #: Modules that a function imports and that were not imported yet, with the names that the function uses.
        self._absent: list[tuple[str, Names]] = []
        self._follow(controller, Names())

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

    def _follow(self, value: Any, names: Names) -> bool:
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

    def _follow_elements(self, value: Any, names: Names) -> None:
        """Adds the functions and classes in a container, of a bound method or of a partial function, and the classes of elements."""
        pending, known = [value], {id(value)}
        while pending:
            for element in _elements_of(pending.pop()):
                if not isinstance(element, CONSTANT) and id(element) not in known and not self._follow(element, names):
                    known.add(id(element))
                    self._follow(type(element), Names())
                    pending.append(element)

    def _is_own(self, module: str | None) -> bool:
        """Returns whether the author of the controller wrote a module."""
        if module is None or module == "builtins":
            return False
        if module.partition(".")[0] == self._package:
            return True
        file = getattr(sys.modules.get(module), "__file__", None)
        return file is not None and is_own(Path(file))

    def _variable(self, name: str, read: Callable[[], Any], owner: object, names: Names = Names()) -> Iterator[Variable]:
        """Yields a variable, unless its value leads to others."""
        value = read()
        if name.rpartition(".")[2] not in self._exempt and not self._follow(value, names):
            self._follow(type(value), Names())
            self._follow_elements(value, names)
            yield Variable(name, read, owner)

    def _of_attributes(self, owner: type | FunctionType, name: str, own: Iterable[str]) -> Iterator[Variable]:
        """Yields these attributes of a class or a function, and a variable with the names of attributes that it gets later."""
        attributes = vars(owner)
        for attribute in own:
            yield from self._variable(f"{name}.{attribute}", partial(attributes.get, attribute, MISSING), owner)
        yield NewAttributes(name, owner, self._exempt)

    def _of_class(self, kind: type) -> Iterator[Variable]:
        for base in (type(kind), *kind.__mro__[1:]):
            self._follow(base, Names())
        own = [name for name in vars(kind) if not is_special(name) or isinstance(vars(kind)[name], FunctionType)]
        if isinstance(kind, EnumMeta):
            # An enumeration stores combined members when they are first used.
            own = [name for name in own if not (name.startswith("_") and name.endswith("_"))]
        yield from self._of_attributes(kind, kind.__name__, own)

    def _of_function(self, function: FunctionType) -> Iterator[Variable]:
        code = function.__code__
        names = _names(code)
        yield from self._of_attributes(function, function.__qualname__, [name for name in vars(function) if not is_special(name)])
        for name, cell in zip(code.co_freevars, function.__closure__ or (), strict=True):
            if not is_special(name):
                yield from self._variable(f"{function.__qualname__}.{name}", partial(_content_of, cell), cell, names)
        given = dict(zip(reversed(code.co_varnames[: code.co_argcount]), reversed(function.__defaults__ or ()), strict=False))
        for name, default in {**given, **(function.__kwdefaults__ or {})}.items():
            yield from self._variable(f"{function.__qualname__}.{name}", partial(_identity, default), function, names)
        for module in _imports(code, function.__globals__.get("__package__") or ""):
            self._follow_import(module, names)
        yield from self._of_namespace(function.__globals__, function.__globals__["__name__"], names)

    def _follow_import(self, module: str, names: Names) -> None:
        if module in sys.modules:
            self._follow(sys.modules[module], names)
        else:
            self._absent.append((module, names))

    def _of_namespace(self, namespace: Mapping[str, Any], module: str, names: Names) -> Iterator[Variable]:
        """Yields the variables of these names. Assigned ones may not exist yet."""
        for name in names.used:
            if name in namespace or (name in names.stored and not hasattr(builtins, name)):
                yield from self._variable(f"{module}.{name}", partial(namespace.get, name, MISSING), namespace, names)


def is_own(file: Path) -> bool:
    """Returns whether the author of the controller wrote a file."""
    return not LIBRARIES & set(file.resolve().parents)


def _identity(value: Any) -> Any:
    return value


def _module_of(value: type | FunctionType) -> str | None:
    """Returns the module with the code of a class or a function. `functools.wraps` changes only `__module__`."""
    return value.__globals__.get("__name__") if isinstance(value, FunctionType) else value.__module__


def _elements_of(value: Any) -> Iterable[Any]:
    if isinstance(value, partial):
        return (value.func, *value.args, *value.keywords.values())
    if isinstance(value, MethodType):
        return (value.__func__, value.__self__)
    if isinstance(value, dict):
        return value.values()
    return value if isinstance(value, CONTAINERS) else ()


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


def _names(code: CodeType) -> Names:
    """Returns the names in a function, with those of the functions in it."""
    stored = {str(instruction.argval) for instruction in dis.get_instructions(code) if instruction.opcode in STORES}
    used = dict.fromkeys(code.co_names)
    for constant in code.co_consts:
        if isinstance(constant, CodeType):
            inner = _names(constant)
            used.update(dict.fromkeys(inner.used))
            stored |= inner.stored
    return Names(tuple(used), frozenset(stored))
