"""What all tests have in common."""

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
    """A module that not every user has. Where it is missing the test fails, but with ALLIANCE_SKIP_TESTS=1."""
    if os.environ.get("ALLIANCE_SKIP_TESTS") == "1":
        return pytest.importorskip(module)
    return importlib.import_module(module)


def program() -> str:
    """The program `alliance`: that of the wheel, or the one that ALLIANCE names."""
    return os.environ.get("ALLIANCE") or str(Path(sys.executable).with_name("alliance"))


@pytest.fixture
def alliance(tmp_path):
    """Runs the program, which must end with one of these statuses."""

    def carry_out(*words: str, status: tuple[int, ...] = (0,)) -> subprocess.CompletedProcess[str]:
        done = subprocess.run([program(), *words], cwd=tmp_path, capture_output=True, text=True, timeout=300)
        assert done.returncode in status, done.stderr
        return done

    return carry_out
