"""What an allocator receives: its own state, sets with places and times, and messages with sizes and knowledge."""

import math

import pytest
from alliance_sim import Allocator, ControllerError, Message, Set, run

#: One robot, and one point 6 m ahead with 5 s of work.
FAR = {
    "name": "far",
    "limit_s": 30.0,
    "room": {"width_m": 12.0, "height_m": 9.0},
    "body": {"speed_m_s": 0.5},
    "robots": [{"name": "one", "start": {"x_m": 2.0, "y_m": 4.5, "heading_deg": 90.0}}],
    "service": {
        "reach_m": 0.3,
        "kinds": [{"name": "visit", "work_s": {"min": 5.0, "max": 5.0}}],
        "points": [{"kind": "visit", "x_m": 8.0, "y_m": 4.5}],
    },
}


class Watcher(Allocator):
    """Executes the first applicable set, and stores its inputs."""

    seen = []
    collected = {"seen"}

    def step(self, now, messages, sets):
        self.seen.append((self, now, self.position, self.heading, messages, sets))
        return next((one for one in sets if one.applicable), None)


def watcher():
    return type("Watcher", (Watcher,), {"seen": []})


def test_travel_and_work_are_apart():
    kind = watcher()
    assert run(FAR, {"*": kind}).complete
    # The robot reads the board in the first step.
    _, _, position, heading, _, (first,) = kind.seen[1]
    assert position == pytest.approx((2.0, 4.5)) and heading == pytest.approx(math.pi / 2, abs=0.1)
    assert first.place == pytest.approx((8.0, 4.5))
    assert first.travel == pytest.approx((6.0 - 0.3) / 0.5, abs=0.1)
    assert first.work == pytest.approx(5.0)
    for _, _, _, _, _, (one,) in kind.seen[1:-1]:
        assert one.travel + one.work == pytest.approx(one.cost)
    _, _, _, _, _, (near,) = kind.seen[-2]
    assert near.travel < 0.1 and near.work < 5.0


def test_a_finished_task_has_no_place():
    points = [{"kind": "visit", "x_m": x, "y_m": 4.5} for x in (2.2, 11.0)]
    kind = watcher()
    run({**FAR, "service": {**FAR["service"], "points": points}}, {"*": kind}, limit=10.0)
    assert [one.place is None for one in kind.seen[-1][-1]] == [True, False]
    assert kind.seen[-1][-1][0].travel == 0.0


@pytest.mark.parametrize("mission", ["waste-cleanup", "parker-box", "cmommt"])
def test_each_mission_has_its_places(mission):
    kind = watcher()
    run(mission, {"*": kind}, limit=100.0)
    sets = [one for *_, sets in kind.seen for one in sets]
    with_place = [one for one in sets if one.place]
    assert bool(with_place) == (mission != "cmommt")
    for one in sets:
        assert one.travel >= 0.0 and one.work >= 0.0
        if one.place is None and one.cost < math.inf:
            assert (one.travel, one.work) == (0.0, one.cost)
    for one in with_place:
        assert one.travel + one.work == pytest.approx(one.cost)


def test_a_robot_has_the_names_of_its_team_and_of_all_tasks():
    kind = watcher()
    run("janitorial", {"gold": kind}, limit=1.0)
    gold = kind.seen[0][0]
    assert gold.team[gold.rank] == "gold" and set(gold.team) == {"blue", "gold", "green"}
    sets = kind.seen[0][-1]
    assert [gold.tasks[one.task] for one in sets] == [one.task_name for one in sets]
    assert len(gold.tasks) > len(sets) and gold.energy is None


def test_sizes_of_messages_are_those_of_the_log():
    kind = watcher()
    done = run("service", {"r1": kind, "*": "nearest"}, robots=2, size=6, limit=30.0)
    messages = [message for *_, messages, _ in kind.seen for message in messages]
    assert len(messages) > 20 and {message.sender for message in messages} == {1}
    sent = done.result["robots"]["r2"]
    # Those of the last tick are not received.
    last = sent["messages_sent"] - len(messages)
    total = sent["bytes_sent"] - sum(message.size for message in messages)
    assert 0 <= last <= 2 and (total == 0 if last == 0 else 20 * last < total < 1000 * last)


def test_shared_knowledge_has_the_types_of_its_mission():
    known = {}
    for mission, size in {"waste-cleanup": {}, "service": {"robots": 2, "size": 6}, "parker-box": {}, "cmommt": {}}.items():
        kind = watcher()
        run(mission, {"*": kind}, limit=60.0, **size)
        messages = [message for *_, messages, _ in kind.seen for message in messages]
        known[mission] = next(message.shared_knowledge for message in reversed(messages) if message.shared_knowledge)
    fact = known["service"][0]["fact"]
    assert set(fact) == {"point", "kind", "round", "at", "left_s"} and len(fact["at"]) == 2
    assert {"bar", "pose"} <= set(known["parker-box"][0])
    assert set(known["cmommt"][0]) == {"target", "at", "when"}
    assert "withdrawn" in known["waste-cleanup"]


def test_sets_and_messages_of_a_test_have_the_same_properties():
    there = Set(0, "dust", 0, cost=5.0, place=(1.0, 2.0), travel=2.0)
    assert (there.place, there.travel, there.work) == ((1.0, 2.0), 2.0, 3.0)
    waits = Set(0, "dust", 0, cost=9.0, place=(1.0, 2.0), travel=2.0, opens_in=6.0)
    assert waits.work == 3.0
    anywhere = Set(1, "search", 1, cost=5.0)
    assert (anywhere.place, anywhere.travel, anywhere.work) == (None, 0.0, 5.0)
    unknown = Set(2, "dust", 2)
    assert (unknown.travel, unknown.work) == (math.inf, math.inf)
    assert Message(1, "executing", task=0, shared_knowledge=[1]).shared_knowledge == [1]
    assert Message(1).shared_knowledge is None
    assert Message(1, content=b"x" * 100).size == Message(1, content=b"").size + 100


def test_a_bid_for_an_unknown_set_is_an_error():
    class Wrong(Allocator):
        def step(self, now, messages, sets):
            self.bid(Set(77, "other", 0), 1.0)

    with pytest.raises(ControllerError, match="bid: there is no set with the id 77"):
        run("service", {"*": Wrong}, limit=1.0)


def test_random_numbers_refuse_what_they_cannot_do():
    class Wrong(Allocator):
        def step(self, now, messages, sets):
            with pytest.raises(ValueError, match="the number of bits is -1"):
                self.rng.getrandbits(-1)
            with pytest.raises(NotImplementedError, match="setstate"):
                self.rng.setstate(None)

    run("service", {"*": Wrong}, limit=0.5)


def test_an_error_that_cannot_be_shown_keeps_robot_and_tick():
    class Odd(Exception):
        def __str__(self):
            raise RuntimeError("no text")

    class Wrong(Allocator):
        error = Odd()

        def step(self, now, messages, sets):
            raise self.error

    with pytest.raises(ControllerError, match=r"r1: tick 0: test_inputs.py:\d+: Odd: the text of the error cannot be created"):
        run("service", {"r1": Wrong}, limit=1.0)
    Wrong.error = ValueError("\x1b[31mred")
    with pytest.raises(ControllerError) as error:
        run("service", {"r1": Wrong}, limit=1.0)
    assert "\x1b" not in str(error.value) and "red" in str(error.value)


def test_a_run_is_a_table_in_a_notebook():
    html = run("service", limit=2.0)._repr_html_()
    assert html.startswith("<table>") and "time-limit" in html and "<th>done</th>" in html
