"""Build backend of the source package: maturin's, after a build of the program `alliance`.

maturin alone would download a compiler if there is none. This backend fails with one line instead.
"""

import os
import shutil
import subprocess
from pathlib import Path

import maturin

#: The folder with the program, which maturin packs into the wheel.
SCRIPTS = Path("data/scripts")

build_sdist = maturin.build_sdist


def _cargo():
    cargo = shutil.which("cargo")
    if cargo is None:
        raise SystemExit(
            "alliance-sim: the source package needs Rust (https://rustup.rs) to build; install a wheel instead"
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
    # Without --locked, because the lock file of the workspace has more packages than these sources.
    target = Path(os.environ.setdefault("CARGO_TARGET_DIR", str(Path("target").resolve())))
    packages = ["--package", "launch", "--package", "python", "--bin", "alliance", "--lib"]
    subprocess.run([_cargo(), "build", "--release", *packages], check=True)
    SCRIPTS.mkdir(parents=True, exist_ok=True)
    program = target / "release" / "alliance"
    subprocess.run(["strip", "-o", SCRIPTS / "alliance", program], check=True)
    return maturin.build_wheel(wheel_directory, config_settings, metadata_directory)
