"""Checks a Kubernetes manifest against the published schema: kubernetes_job.py FILE"""

import sys

import kubernetes_validate
import yaml

with open(sys.argv[1], encoding="utf-8") as file:
    job = yaml.safe_load(file)
kubernetes_validate.validate(job, kubernetes_validate.latest_version(), strict=True)
broken = {**job, "spec": {**job["spec"], "completion": 8}}
try:
    kubernetes_validate.validate(broken, kubernetes_validate.latest_version(), strict=True)
except kubernetes_validate.ValidationError:
    pass
else:
    sys.exit("an unknown key is not detected")
spec = job["spec"]
print(job["kind"], spec["completionMode"], spec["completions"], kubernetes_validate.latest_version())
