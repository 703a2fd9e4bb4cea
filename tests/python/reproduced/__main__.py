"""Measures published results with the simulator, and writes docs/REPRODUCED.md.

usage: python3 tests/python/reproduced [--check] [--program PROGRAM] [--data DIR] [--instances DIR]
                                         [--implementations DIR] [SECTION...]
"""

import argparse
import importlib
import json
import shutil
import sys
import tempfile
from pathlib import Path

import page
from lab import ROOT, Lab, rounded

GOLDEN = ROOT / "tests/golden/reproduced.json"
PAGE = ROOT / "docs/REPRODUCED.md"
# The modules of the sections, in the order of the page.
SECTIONS = ["grape", "cbba", "public", "bounds", "space", "routing", "thesis", "teams"]


def arguments():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument(
        "sections", nargs="*", metavar="SECTION", help=f"some of {', '.join(SECTIONS)}; by default all"
    )
    parser.add_argument("--check", action="store_true", help="repeat a cheap part and compare; write nothing")
    parser.add_argument("--program", default="alliance", help="the program under test")
    data = ROOT.parent / "shared/data"
    parser.add_argument("--data", type=Path, default=data, help="the folder with grape/ and space_runs.csv")
    parser.add_argument("--instances", type=Path, help="the folder with RC101.txt, RC208.vrp, PR01.vrp and PR11A.vrp")
    parser.add_argument("--implementations", type=Path, help="the folder with CBBA-Python/ and space-simulator/")
    given = parser.parse_args()
    for name in given.sections:
        if name not in SECTIONS:
            parser.error(f"there is no section '{name}'; use {', '.join(SECTIONS)}")
    program = shutil.which(given.program)
    if program is None:
        parser.error(f"--program: there is no program '{given.program}'; build it or state its path")
    # The program runs in another folder.
    given.program = Path(program).resolve()
    given.instances = given.instances and given.instances.resolve()
    given.implementations = given.implementations and given.implementations.resolve()
    return given


def imported(name):
    """Returns the module of a section, or `None` if a package is missing."""
    try:
        return importlib.import_module(name)
    except ModuleNotFoundError as error:
        why = f"there is no Python package {error.name}; see tests/python/requirements.txt"
        print(f"skipped: {name}: {why}", file=sys.stderr)
        return None


def differences(found, golden, at):
    """Returns the places at which new figures differ from stored ones. There may be more stored figures."""
    if isinstance(found, dict) and isinstance(golden, dict):
        return [line for key in found for line in differences(found[key], golden.get(key), f"{at}.{key}")]
    return [] if found == golden else [f"{at}: {found} instead of {golden}"]


def main():
    given = arguments()
    golden = json.loads(GOLDEN.read_text()) if GOLDEN.exists() else {}
    wrong = []
    modules = {name: imported(name) for name in SECTIONS}
    for name in given.sections or SECTIONS:
        section = modules[name]
        if section is None:
            continue
        missing = section.missing(given)
        if missing:
            print(f"skipped: {name}: {missing}", file=sys.stderr)
            continue
        with tempfile.TemporaryDirectory() as folder:
            lab = Lab(given.program, folder, given.data)
            lab.instances, lab.implementations = given.instances, given.implementations
            # JSON has lists and texts as keys only.
            found = json.loads(json.dumps(rounded(section.measure(lab, given.check))))
        print(f"{name}: measured", file=sys.stderr)
        if given.check:
            wrong += differences(found, golden.get(name), name)
        else:
            golden[name] = found
            GOLDEN.write_text(json.dumps(golden, indent=1) + "\n", encoding="utf-8")
    if None in modules.values():
        print(f"skipped: {PAGE.name}: it needs the packages of all sections", file=sys.stderr)
    else:
        sections = [modules[name].sections(golden[name]) for name in SECTIONS if name in golden]
        text = page.page(sum(sections, []))
        if not given.check:
            PAGE.write_text(text, encoding="utf-8")
        elif PAGE.read_text(encoding="utf-8") != text:
            wrong.append(f"{PAGE}: the page differs from {GOLDEN.name}; run this command without --check")
    for line in wrong:
        print(line, file=sys.stderr)
    return 1 if wrong else 0


sys.exit(main())
