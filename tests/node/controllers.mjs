// Controllers of a robot. `copy` is a checkpoint.

import { decode, encode } from "./codec.mjs";

const variant = (name, content = null) => ({ name, content });

/** Returns cosine and sine by additions and multiplications alone, which have the same bits on every machine. */
export function direction(angle) {
    const x = angle / 8;
    const xx = x * x;
    let cos = 1 - (xx / 2) * (1 - (xx / 12) * (1 - (xx / 30) * (1 - xx / 56)));
    let sin = x * (1 - (xx / 6) * (1 - (xx / 20) * (1 - (xx / 42) * (1 - xx / 72))));
    for (let count = 0; count < 3; count += 1) [cos, sin] = [cos * cos - sin * sin, 2 * cos * sin];
    return [cos, sin];
}

/** Stands still and sends heartbeats. */
class Still {
    constructor(name, setup) {
        const sets = Object.values(setup.alliance.robots[name].sets);
        this.period = Math.max(...sets.map((set) => Math.round(1000 / set.broadcast_rate_hz)));
        this.since = this.sent = null;
    }

    copy() {
        return Object.assign(Object.create(Object.getPrototypeOf(this)), this);
    }

    /** Returns the actuation and the bodies of broadcasts. */
    step(now, readings) {
        this.since ??= now;
        const bodies = [];
        if (this.sent === null || now - this.sent >= this.period) {
            this.sent = now;
            bodies.push(variant("Heartbeat", this.heartbeat(readings)));
        }
        return [{ speed_m_s: 0, turn_rad_s: 0, action: variant("nothing") }, bodies];
    }

    heartbeat({ pose, mission }) {
        return {
            state: variant("Idle"),
            since: this.since,
            set: null,
            task: null,
            progress: 0,
            position: pose && pose.position,
            carrying: mission.name === "items" && mission.content.holding === true,
            shared_knowledge: variant("nothing"),
        };
    }
}

/** Turns by sender, time and order of the received heartbeats. */
class Listener extends Still {
    step(now, readings, broadcasts) {
        const [actuation, bodies] = super.step(now, readings);
        const heartbeats = broadcasts.filter(({ body }) => body.name === "Heartbeat");
        const terms = heartbeats.map(({ sender, sent }, place) => (place + 1) * (sender + 1) * (Math.floor(sent / 50) + 1));
        const sum = terms.reduce((total, term) => total + term, 0);
        return [{ ...actuation, turn_rad_s: (sum % 128) / 128 }, bodies];
    }
}

/** Works in the mission service: goes straight to the nearest open point that it knows. */
class Worker extends Still {
    constructor(name, setup) {
        super(name, setup);
        this.reachM = setup.scenario.service.reach_m;
        // Observed facts by point, and the last line of the board.
        this.known = new Map();
        this.line = null;
    }

    copy() {
        return Object.assign(super.copy(), { known: new Map(this.known) });
    }

    step(now, readings, broadcasts) {
        this.learn(now, readings, broadcasts);
        const [actuation, bodies] = super.step(now, readings);
        const read = this.line;
        const act = (work) => variant("open", encode("service::Action", { work, read }));
        const { pose } = readings;
        const target = pose && this.nearest(pose.position);
        if (!target) return [{ ...actuation, action: act(null) }, bodies];
        const [x, y] = target.at.map((place, axis) => place - pose.position[axis]);
        if (x * x + y * y < 0.81 * this.reachM * this.reachM) return [{ ...actuation, action: act(target.point) }, bodies];
        const [cos, sin] = direction(pose.heading_rad);
        const [ahead, left] = [x * cos + y * sin, y * cos - x * sin];
        if (Math.abs(left) > 0.2 * ahead) return [{ ...actuation, turn_rad_s: left < 0 ? -1 : 1, action: act(null) }, bodies];
        return [{ speed_m_s: 0.25, turn_rad_s: left / ahead, action: act(null) }, bodies];
    }

    /** Learns from the board and from the shared knowledge of teammates. */
    learn(now, { mission }, broadcasts) {
        for (const { body } of broadcasts) {
            const shared = body.name === "Heartbeat" && body.content.shared_knowledge;
            if (shared && shared.name === "open") decode({ list: "service::ObservedFact" }, shared.content).forEach((news) => this.merge(news));
        }
        const reading = mission.name === "open" ? decode("service::SensorReading", mission.content) : { points: null, board_line: null };
        for (const fact of reading.points ?? []) this.merge({ fact, sensed: now });
        this.line = reading.board_line ?? this.line;
    }

    merge(news) {
        const old = this.known.get(news.fact.point);
        const isNewer = !old || news.fact.round > old.fact.round || (news.fact.round === old.fact.round && news.sensed > old.sensed);
        if (isNewer) this.known.set(news.fact.point, news);
    }

    nearest([x, y]) {
        let [best, least] = [null, Infinity];
        for (const { fact } of this.sorted()) {
            const [dx, dy] = [fact.at[0] - x, fact.at[1] - y];
            const square = dx * dx + dy * dy;
            if (fact.left_s > 0 && square < least) [best, least] = [fact, square];
        }
        return best;
    }

    sorted() {
        return [...this.known.values()].sort((one, other) => one.fact.point - other.fact.point);
    }

    heartbeat(readings) {
        const shared = encode({ list: "service::ObservedFact" }, this.sorted().slice(0, 20));
        return { ...super.heartbeat(readings), shared_knowledge: variant("open", shared) };
    }
}

export const controllers = { still: Still, listener: Listener, worker: Worker };
