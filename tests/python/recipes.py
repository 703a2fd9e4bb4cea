"""Checks a recipe for containers against the published schema, and prints its commands as JSON: recipes.py compose|kubernetes FILE"""

import json
import subprocess
import sys

import kubernetes_validate
import yaml


def check_compose(text):
    command = [sys.executable, "-m", "check_jsonschema", "--builtin-schema", "vendor.compose-spec"]
    command += ["--default-filetype", "yaml", "-"]
    return subprocess.run(command, input=text, text=True, capture_output=True, check=False).returncode == 0


def check_kubernetes(text):
    try:
        for document in yaml.safe_load_all(text):
            kubernetes_validate.validate(document, kubernetes_validate.latest_version(), strict=True)
    except kubernetes_validate.ValidationError as error:
        print(error.message, file=sys.stderr)
        return False
    return True


def containers(kind, text):
    for document in yaml.safe_load_all(text):
        if kind == "compose":
            yield from ((name, service["command"]) for name, service in document["services"].items())
        elif document["kind"] == "Job":
            for container in document["spec"]["template"]["spec"]["containers"]:
                yield container["name"], container["args"]


kind, path = sys.argv[1:]
with open(path, encoding="utf-8") as file:
    text = file.read()
check = {"compose": check_compose, "kubernetes": check_kubernetes}[kind]
if not check(text):
    sys.exit(f"{path} violates its schema")
for right, wrong in [("image:", "immage:"), ("volumes:", "volume:")]:
    if check(text.replace(right, wrong, 1)):
        sys.exit(f"{wrong} is not detected")
print(json.dumps(dict(containers(kind, text))))
