"""Sends valid and invalid requests to a live run, which stays paused. Prints each reply as a line of JSON: {"NAME": REPLY}. The test in
tests/missions/control_python.rs reads them."""

import json
import sys
import time

import zenoh
from control import send_command, connect, find_run, seal


def show(name, reply):
    print(json.dumps({name: reply}), flush=True)


def send(session, run, text, mark, **options):
    """Sends a raw request and returns the first reply or error."""
    key = f"alliance/{run['run']}/control"
    options.setdefault("encoding", zenoh.Encoding.APPLICATION_JSON)
    for reply in session.get(key, payload=text, attachment=mark, timeout=10.0, **options):
        if reply.ok is not None:
            return {"reply": json.loads(reply.ok.payload.to_string())}
        return {"error": reply.err.payload.to_string()}
    return None


def main(run):
    key = f"alliance/{run['run']}/control"

    def request(nonce, command):
        text = json.dumps({"nonce": nonce, "command": command})
        return text, seal(run, key, text)

    with connect(run) as session:
        show("paused", send_command(session, run, {"clock": "pause"}))

        # The world replies to a query.
        kill = send_command(session, run, {"fault": {"fault": {"kill": "gold"}}}, nonce="kill-gold")
        show("kill", kill)
        # A put gets no reply. The session keeps the order of both.
        drop = {"id": "deaf-blue", "fault": {"drop": {"to": "blue", "p": 1.0}}, "for_s": 5}
        text, mark = request("drop", {"fault": drop})
        session.put(key, text, attachment=mark, encoding=zenoh.Encoding.APPLICATION_JSON)

        # The world refuses all of these.
        text, mark = request("kill-gold", {"fault": {"fault": {"kill": "gold"}}})
        show("replayed", send(session, run, text, mark))
        session.put(key, text, attachment=mark, encoding=zenoh.Encoding.APPLICATION_JSON)
        text, mark = request("glod", {"fault": {"fault": {"kill": "glod"}}})
        show("misspelled", send(session, run, text, mark))
        text, mark = request("dance", {"dance": "gold"})
        show("malformed", send(session, run, text, mark))
        show("cut", send(session, run, text[:20], seal(run, key, text[:20])))
        text, mark = request("kill-blue", {"fault": {"fault": {"kill": "blue"}}})
        show("no seal", send(session, run, text, None))
        show("wrong seal", send(session, run, text, mark.replace(mark[0], "0" if mark[0] != "0" else "1")))
        stranger = dict(run, token="0" * 32)
        show("stranger", send(session, run, text, seal(stranger, key, text)))
        session.put(key, text, attachment=seal(stranger, key, text), encoding=zenoh.Encoding.APPLICATION_JSON)
        show("no encoding", send(session, run, text, mark, encoding=zenoh.Encoding.ZENOH_BYTES))

        # Gold is killed in this tick.
        show("step", send_command(session, run, {"clock": {"step": 1}}))
        for _ in range(600):
            status = send_command(session, run, "status")
            if status["status"]["tick"] > kill["armed"]["tick"]:
                break
            time.sleep(0.1)
        show("status", status)
        show("list", send_command(session, run, "list"))


if __name__ == "__main__":
    main(find_run(*sys.argv[1:]))
