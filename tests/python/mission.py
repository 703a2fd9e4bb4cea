"""What a foreign program does to a live run, which it leaves paused; prints each reply as a line of JSON: {"WHAT": REPLY}. The test of the same name
(tests/missions/control_python.rs) reads them."""

import json
import sys
import time

import zenoh
from control import ask, connect, find_run, seal


def tell(what, reply):
    print(json.dumps({what: reply}), flush=True)


def send(session, run, text, mark, **options):
    """The first answer to a request that is written by hand: a reply, or what the world complains of."""
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
        tell("paused", ask(session, run, {"clock": "pause"}))

        # A query is answered.
        kill = ask(session, run, {"fault": {"fault": {"kill": "gold"}}}, nonce="kill-gold")
        tell("kill", kill)
        # A put is not. The same session keeps the order of the two.
        drop = {"id": "deaf-blue", "fault": {"drop": {"to": "blue", "p": 1.0}}, "for_s": 5}
        text, mark = request("drop", {"fault": drop})
        session.put(key, text, attachment=mark, encoding=zenoh.Encoding.APPLICATION_JSON)

        # None of these is obeyed.
        text, mark = request("kill-gold", {"fault": {"fault": {"kill": "gold"}}})
        tell("replayed", send(session, run, text, mark))
        session.put(key, text, attachment=mark, encoding=zenoh.Encoding.APPLICATION_JSON)
        text, mark = request("glod", {"fault": {"fault": {"kill": "glod"}}})
        tell("misspelled", send(session, run, text, mark))
        text, mark = request("dance", {"dance": "gold"})
        tell("malformed", send(session, run, text, mark))
        tell("cut", send(session, run, text[:20], seal(run, key, text[:20])))
        text, mark = request("kill-blue", {"fault": {"fault": {"kill": "blue"}}})
        tell("no seal", send(session, run, text, None))
        tell("wrong seal", send(session, run, text, mark.replace(mark[0], "0" if mark[0] != "0" else "1")))
        stranger = dict(run, token="0" * 32)
        tell("stranger", send(session, run, text, seal(stranger, key, text)))
        session.put(key, text, attachment=seal(stranger, key, text), encoding=zenoh.Encoding.APPLICATION_JSON)
        tell("no encoding", send(session, run, text, mark, encoding=zenoh.Encoding.ZENOH_BYTES))

        # The tick in which gold dies.
        tell("step", ask(session, run, {"clock": {"step": 1}}))
        for _ in range(600):
            status = ask(session, run, "status")
            if status["status"]["tick"] > kill["armed"]["tick"]:
                break
            time.sleep(0.1)
        tell("status", status)
        tell("list", ask(session, run, "list"))


if __name__ == "__main__":
    main(find_run(*sys.argv[1:]))
