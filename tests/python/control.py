"""Sends one command to a live run and prints the reply: control.py COMMAND [RUN]

COMMAND is JSON as in docs/CONTROL.md: '"status"', '{"fault": {"fault": {"kill": "gold"}}}'. RUN is the id of a live run, by
default the newest. Needs only the package eclipse-zenoh.
"""

import hmac
import json
import os
import pathlib
import secrets
import sys
import tempfile

import zenoh


def is_alive(pid):
    try:
        os.kill(pid, 0)
    except OSError:
        return False
    return True


def find_run(run=None):
    """Returns the announcement of a live run: its id, endpoint, pid and token."""
    base = os.environ.get("XDG_RUNTIME_DIR", "")
    folder = pathlib.Path(base, "alliance")
    if not os.path.isdir(base):
        folder = pathlib.Path(tempfile.gettempdir(), f"alliance-{os.geteuid()}")
    files = sorted(folder.glob("*.json"), key=lambda file: file.stat().st_mtime, reverse=True)
    for found in (json.loads(file.read_text()) for file in files):
        if run in (None, found["run"]) and is_alive(found["pid"]):
            return found
    sys.exit("no such run is live")


def connect(run):
    """Opens a zenoh session as a client of the run."""
    config = zenoh.Config()
    config.insert_json5("mode", '"client"')
    config.insert_json5("connect/endpoints", json.dumps([run["endpoint"]]))
    config.insert_json5("scouting/multicast/enabled", "false")
    config.insert_json5("transport/auth/usrpwd/user", '"alliance"')
    config.insert_json5("transport/auth/usrpwd/password", json.dumps(run["token"]))
    return zenoh.open(config)


def seal(run, key, text):
    """Returns the seal of a message for this key, which proves that the sender has the run's token."""
    return hmac.new(run["token"].encode(), key.encode() + b"\0" + text.encode(), "sha256").hexdigest()


def send_command(session, run, command, nonce=None):
    """Sends a command and returns the world's reply."""
    nonce = nonce or secrets.token_hex(16)
    key = f"alliance/{run['run']}/control"
    text = json.dumps({"nonce": nonce, "command": command})
    error = "no answer"
    for reply in session.get(
        key,
        payload=text,
        encoding=zenoh.Encoding.APPLICATION_JSON,
        attachment=seal(run, key, text),
        target=zenoh.QueryTarget.ALL,
        consolidation=zenoh.ConsolidationMode.NONE,
        timeout=10.0,
    ):
        if reply.ok is None:
            error = reply.err.payload.to_string()
            continue
        text, mark = reply.ok.payload.to_string(), reply.ok.attachment
        # Other clients may reply, too. Only a reply that is sealed for this request counts.
        if mark and hmac.compare_digest(mark.to_string(), seal(run, f"{key}/{nonce}", text)):
            return json.loads(text)
    raise RuntimeError(error)


if __name__ == "__main__":
    if len(sys.argv) not in (2, 3):
        sys.exit(__doc__.strip())
    found = find_run(*sys.argv[2:])
    with connect(found) as bus:
        print(json.dumps(send_command(bus, found, json.loads(sys.argv[1]))))
