"""Types and documentation: stubs match the engine, and `help()` shows meaning and unit of everything that users see."""

import ast
import dataclasses
import inspect
import subprocess
import sys
from pathlib import Path

import alliance_sim
import pytest
from alliance_sim import Agent, Allocator, Message, Set, _engine, math
from alliance_sim._controllers import Controller
from conftest import ROOT, needed

PACKAGE = Path(alliance_sim.__file__).parent


def documented(stub):
    """Returns the documentation of a stub by qualified name."""
    found = {}

    def walk(node, prefix):
        for child in node.body:
            if isinstance(child, ast.ClassDef | ast.FunctionDef):
                name = f"{prefix}{child.name}"
                text = ast.get_docstring(child)
                if text:
                    found[name] = text
                if isinstance(child, ast.ClassDef):
                    walk(child, f"{name}.")

    walk(ast.parse((PACKAGE / stub).read_text()), "")
    return found


def named(module, name):
    for part in name.split("."):
        module = getattr(module, part)
    return module


@pytest.mark.parametrize(("stub", "module"), [("_engine.pyi", _engine), ("math.pyi", math)])
def test_help_shows_the_documentation_of_the_stub(stub, module):
    texts = documented(stub)
    assert len(texts) >= 20
    for name, text in texts.items():
        assert inspect.getdoc(named(module, name)) == text, name


@pytest.mark.parametrize("kind", [Set, Message])
def test_every_property_has_a_meaning(kind):
    properties = [name for name, value in vars(kind).items() if inspect.isdatadescriptor(value)]
    assert len(properties) > 10
    for name in properties:
        assert len((getattr(kind, name).__doc__ or "").split()) >= 3, name


@pytest.mark.parametrize("kind", [Controller, Allocator, Agent, alliance_sim.Readings, alliance_sim.Action, alliance_sim.Run])
def test_every_attribute_is_in_the_documentation_of_its_class(kind):
    names = [field.name for field in dataclasses.fields(kind)] if dataclasses.is_dataclass(kind) else inspect.get_annotations(kind)
    for name in names:
        assert name.startswith("_") or name == "step" or f"`{name}`" in inspect.getdoc(kind), name


def test_every_function_for_users_is_documented():
    for name in alliance_sim.__all__:
        value = getattr(alliance_sim, name)
        if callable(value):
            assert len((inspect.getdoc(value) or "").split()) > 3, name


def checked(*words, folder):
    process = subprocess.run([sys.executable, "-m", *words], cwd=folder, capture_output=True, text=True, timeout=600)
    assert process.returncode == 0, process.stdout + process.stderr


def test_stubs_match_the_engine(tmp_path):
    needed("mypy")
    checked("mypy.stubtest", "alliance_sim", folder=tmp_path)


def test_the_package_and_a_users_program_have_correct_types(tmp_path):
    needed("mypy")
    checked("mypy", "--strict", str(ROOT / "python/python/alliance_sim"), folder=tmp_path)
    program = """
from collections.abc import Sequence
from alliance_sim import Allocator, Message, Set, run
from alliance_sim.env import parallel_env

class Nearest(Allocator):
    def step(self, now: float, messages: Sequence[Message], sets: Sequence[Set]) -> Set | None:
        sizes = sum(message.size for message in messages)
        self.bid(sets[0], float(sizes))
        return min((one for one in sets if one.applicable), key=lambda one: one.travel + one.work, default=None)

reveal_type(run("service", {"*": Nearest}).seconds)
parallel_env("service", level="drive", ticks=10)
"""
    (tmp_path / "program.py").write_text(program)
    checked("mypy", "--strict", "program.py", folder=tmp_path)
    (tmp_path / "program.py").write_text(program.replace("level=", "levl="))
    with pytest.raises(AssertionError, match='Unexpected keyword argument "levl"'):
        checked("mypy", "--strict", "program.py", folder=tmp_path)
