"""The build backend of the sources: maturin's, once the program `alliance` lies where maturin packs it from.

maturin alone would fetch a compiler where there is none. Here its absence is one line.
"""

import os
import shutil
import subprocess
from pathlib import Path

import maturin

#: From where the wheel takes the program.
SCRIPTS = Path("data/scripts")

build_sdist = maturin.build_sdist


def _cargo():
    cargo = shutil.which("cargo")
    if cargo is None:
        raise SystemExit(
            "alliance-agent: these are its sources, which take Rust (https://rustup.rs) to build; a wheel takes nothing"
        )
    return cargo


def get_requires_for_build_sdist(config_settings=None):
    return []


def get_requires_for_build_wheel(config_settings=None):
    _cargo()
    return []


def prepare_metadata_for_build_wheel(metadata_directory, config_settings=None):
    SCRIPTS.mkdir(parents=True, exist_ok=True)
    return maturin.prepare_metadata_for_build_wheel(metadata_directory, config_settings)


def build_wheel(wheel_directory, config_settings=None, metadata_directory=None):
    # Not --locked: the lock file of the workspace has more in it than these sources.
    target = Path(os.environ.setdefault("CARGO_TARGET_DIR", str(Path("target").resolve())))
    packages = ["--package", "launch", "--package", "bindings", "--bin", "alliance", "--lib"]
    subprocess.run([_cargo(), "build", "--release", *packages], check=True)
    SCRIPTS.mkdir(parents=True, exist_ok=True)
    program = target / "release" / "alliance"
    subprocess.run(["strip", "-o", SCRIPTS / "alliance", program], check=True)
    return maturin.build_wheel(wheel_directory, config_settings, metadata_directory)
