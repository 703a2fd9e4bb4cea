"""Checks JSON in text messages of ROS 2 against the published schema, docs/ros.schema.json."""

import json
import sys
from pathlib import Path

from jsonschema import Draft202012Validator

SCHEMA = json.loads(Path(__file__).parents[2].joinpath("docs/ros.schema.json").read_text())


def check_texts(kind, texts):
    """Checks the texts of a topic, which has a definition of that name in the schema."""
    validator = Draft202012Validator(SCHEMA | {"$ref": f"#/$defs/{kind}"})
    for text in texts:
        for problem in validator.iter_errors(json.loads(text)):
            sys.exit(f"{kind}: {problem.json_path}: {problem.message}: {text}")
