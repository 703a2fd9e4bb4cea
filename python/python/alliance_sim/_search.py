"""Search for the variables that a controller class can reach, through its methods and the modules of its author."""

from __future__ import annotations

import builtins
import dis
import sys
import sysconfig
from collections.abc import Callable, Iterable, Iterator, Mapping
from functools import partial
from pathlib import Path
from types import CodeType, FunctionType, ModuleType
from typing import Any

from ._variable import MISSING, NewAttributes, Variable, is_special

#: Folders of the standard library, of installed packages and of this package. Their variables are not checked.
LIBRARIES = {Path(sysconfig.get_path(name)).resolve() for name in ("stdlib", "platstdlib", "purelib", "platlib")} | {Path(__file__).resolve().parent}

#: Instruction that assigns a global variable.
STORE_GLOBAL = dis.opmap["STORE_GLOBAL"]

#: Instruction that imports a module.
IMPORT_NAME = dis.opmap["IMPORT_NAME"]


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
        own = [name for name in vars(kind) if not is_special(name) or isinstance(vars(kind)[name], FunctionType)]
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


def is_own(file: Path) -> bool:
    """Returns whether the author of the controller wrote a file."""
    return not LIBRARIES & set(file.resolve().parents)


def _identity(value: Any) -> Any:
    return value


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
