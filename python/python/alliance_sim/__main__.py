"""Command `python3 -m alliance_sim`: sweeps, comparisons, searches and suites with controllers in Python.

`alliance sweep`, `compare`, `tune` and `bench` start it for `--controller NAME=FILE`.
"""

from __future__ import annotations

import importlib.util
import os
import signal
import sys
from collections.abc import Iterable
from pathlib import Path
from types import ModuleType
from typing import NoReturn

from . import _engine
from ._controllers import Agent, Allocator
from ._engine import ScenarioError
from ._run import name_of
from ._search import is_own


def controller_in(file: Path, name: str) -> type[Allocator] | type[Agent]:
    """Imports a file and returns its controller of that name. As for `python3 FILE`, it can import modules of its folder."""
    if not file.is_file():
        raise ScenarioError(f"--controller {name}: {file}: there is no such file")
    module = file.stem
    loaded = sys.modules.get(module) or imported(file, name)
    # A file can contain several controllers.
    if _file_of(loaded) != file.resolve():
        raise ScenarioError(f"--controller {name}: {file}: a module '{module}' is already imported; rename the file")
    values = vars(loaded).values()
    controllers = [value for value in values if isinstance(value, type) and issubclass(value, (Allocator, Agent)) and value.__module__ == module]
    named = {name_of(controller): controller for controller in controllers}
    if name not in named:
        known = f"there are {', '.join(named)}" if named else "there are none"
        raise ScenarioError(f"--controller {name}: {file}: there is no controller '{name}'; {known}")
    return named[name]


def imported(file: Path, name: str) -> ModuleType:
    """Imports a file for its controller of that name."""
    spec = importlib.util.spec_from_file_location(file.stem, file.resolve())
    if spec is None or spec.loader is None:
        raise ScenarioError(f"--controller {name}: {file}: this is not a file of Python; its name ends with .py")
    sys.path.insert(0, str(file.resolve().parent))
    sys.modules[file.stem] = module = importlib.util.module_from_spec(spec)
    try:
        spec.loader.exec_module(module)
    except Exception as error:
        why = " ".join(f"{type(error).__name__}: {error}".split())
        raise ScenarioError(f"--controller {name}: {file}: {why}") from error
    return module


def modules_beside(files: Iterable[Path]) -> list[Path]:
    """Returns the files of the imported modules in the folders of these files, by the name of the module."""
    own = {file.resolve() for file in files}
    folders = {file.parent for file in own}
    found = {name: _file_of(module) for name, module in sys.modules.items()}
    beside = {name: file for name, file in found.items() if file is not None and file.suffix == ".py" and is_own(file)}
    return [file for _, file in sorted(beside.items()) if file not in own and folders & set(file.parents)]


def _file_of(module: ModuleType) -> Path | None:
    file = getattr(module, "__file__", None)
    return Path(file).resolve() if isinstance(file, str) else None


def files_in(words: list[str]) -> dict[str, Path]:
    """Returns the files of `--controller NAME=FILE` by name. The program checks all words later, with these controllers."""
    values = [following for word, following in zip(words, words[1:], strict=False) if word == "--controller"]
    values += [word.partition("=")[2] for word in words if word.startswith("--controller=")]
    return {name: Path(file) for name, _, file in (value.partition("=") for value in values) if name and file}


def main() -> NoReturn:
    """Executes the command, with the exit statuses of the program `alliance`."""
    if sys.flags.hash_randomization and "PYTHONHASHSEED" not in os.environ:
        # A fixed hash seed: the same inputs must give the same bytes, even if a controller iterates over a set of texts.
        os.execve(sys.executable, sys.orig_argv, {**os.environ, "PYTHONHASHSEED": "0"})
    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:
        # The command handles Ctrl-C itself. Python would also raise a KeyboardInterrupt, after the command's last line.
        signal.signal(signal.SIGINT, signal.SIG_DFL)
    words = ["alliance", *sys.argv[1:]]
    try:
        files = files_in(words)
        controllers = [(name, controller_in(file, name)) for name, file in files.items()]
        status = _engine.execute_plan(words, controllers, modules_beside(files.values()))
    except (ScenarioError, TypeError) as error:
        print(f"alliance: {error}", file=sys.stderr)
        status = 2
    sys.exit(status)


if __name__ == "__main__":
    main()
