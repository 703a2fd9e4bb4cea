"""Shared fixtures of all tests."""

import importlib
import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[3]
EXAMPLES = ROOT / "docs/examples/python"
sys.path.insert(0, str(EXAMPLES))


def needed(module: str):
    """Imports an optional module. Without it the test fails, or is skipped with ALLIANCE_SKIP_TESTS=1."""
    if os.environ.get("ALLIANCE_SKIP_TESTS") == "1":
        return pytest.importorskip(module)
    return importlib.import_module(module)


def program() -> str:
    """Returns the program `alliance`: the path in ALLIANCE, or else the program of the wheel."""
    return os.environ.get("ALLIANCE") or str(Path(sys.executable).with_name("alliance"))


@pytest.fixture
def alliance(tmp_path):
    """Runs the program and checks its exit status."""

    def run_program(*words: str, status: tuple[int, ...] = (0,)) -> subprocess.CompletedProcess[str]:
        process = subprocess.run([program(), *words], cwd=tmp_path, capture_output=True, text=True, timeout=300)
        assert process.returncode in status, process.stderr
        return process

    return run_program
