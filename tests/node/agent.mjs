// A robot's agent in JavaScript, written from docs/WIRE.md and docs/wire.schema.json.
//
//     node agent.mjs [--robot NAME] [--run ID] [--controller still|listener|worker] [--python PYTHON]
//     node agent.mjs --check          compare with the test vectors
//
// PYTHON has the package eclipse-zenoh, for the relay (bus.mjs).

import { randomBytes } from "node:crypto";
import process from "node:process";
import { setTimeout as sleep } from "node:timers/promises";

import { Bus, findRun } from "./bus.mjs";
import { check } from "./check.mjs";
import { decodeOrNull, schema } from "./codec.mjs";
import { controllers } from "./controllers.mjs";
import { Links } from "./links.mjs";

function exit(reason) {
    process.stderr.write(`${reason}\n`);
    process.exit(1);
}

/** Joins as a robot and returns the welcome. Repeats the query while the former agent's end is not detected. */
async function join(bus, robot) {
    const key = `${bus.prefix}/join/${robot}`;
    for (const until = Date.now() + 1000; ; await sleep(50)) {
        const nonce = randomBytes(16).toString("hex");
        const request = { version: schema.version, robot, pid: process.pid, nonce: BigInt(`0x${nonce}`) };
        const replies = await bus.query(key, bus.seal(key, "JoinRequest", request));
        const answer = replies.map((sealed) => bus.open(`${key}/${nonce}`, "JoinReply", sealed)).find(Boolean);
        if (!answer) exit("no answer");
        if (answer.name === "Welcome") return answer.content;
        if (answer.content.name !== "Taken" || Date.now() > until) exit(`refused: ${answer.content.name}`);
    }
}

/** One incarnation of a robot. */
class Agent {
    constructor(bus, robot, Controller, welcome) {
        const setup = JSON.parse(welcome.setup);
        // JSON.parse rounds a large seed.
        const seed = BigInt(welcome.setup.match(/^\{"seed":(\d+)/)[1]);
        this.bus = bus;
        this.me = { rank: welcome.robot, incarnation: welcome.incarnation };
        this.reportKey = `${bus.prefix}/robot/${robot}/report`;
        this.heartbeatKey = `${bus.prefix}/team/${robot}/heartbeat`;
        const links = new Links(welcome.robot, seed, setup.scenario.step_ms);
        this.state = this.before = { controller: new Controller(robot, setup), links, seq: 0 };
        this.latest = null;
        this.published = [];
    }

    receiveTick({ tick, broadcasts }) {
        if (tick.incarnation > this.me.incarnation) exit("another process controls this robot");
        if (tick.incarnation < this.me.incarnation || (this.latest !== null && tick.tick < this.latest)) return;
        if (tick.tick === this.latest) {
            this.publish();
            return;
        }
        const last = this.latest;
        this.latest = tick.tick;
        const decoded = broadcasts.map((bytes) => bytes && decodeOrNull("Broadcast", bytes));
        this.step(tick, last, tick.manifest.map((entry) => [entry, decoded.splice(0, entry.count)]));
    }

    step(tick, last, arrived) {
        // The latest step did not count.
        if (last !== null && (tick.last_counted === null || tick.last_counted < last)) this.state = this.before;
        this.before = this.state;
        const { controller, links, seq } = { ...this.state, controller: this.state.controller.copy(), links: this.state.links.copy() };
        const [received, receptions] = links.receive(tick, arrived);
        const [actuation, bodies] = controller.step(tick.now, tick.readings, received);
        this.state = { controller, links, seq: seq + bodies.length };
        const { rank, incarnation } = this.me;
        const sender = { sender: rank, incarnation, tick: tick.tick, sent: tick.now };
        this.published = bodies.map((body, index) => {
            const broadcast = { ...sender, index, seq: seq + index, body };
            return [this.heartbeatKey, this.bus.seal(this.heartbeatKey, "Broadcast", broadcast)];
        });
        const bytes = this.published.reduce((sum, [, sealed]) => sum + sealed.length, 0);
        const report = {
            robot: rank,
            incarnation,
            tick: tick.tick,
            actuation,
            broadcasts: bodies.length,
            broadcast_bytes: bytes,
            active: null,
            motivations: [],
            allocation: [],
            changes: [],
            notes: [],
            receptions,
        };
        this.published.push([this.reportKey, this.bus.seal(this.reportKey, "Report", report)]);
        this.publish();
    }

    publish() {
        for (const [key, sealed] of this.published) this.bus.send("P", key, sealed);
    }
}

async function live(robot, run, controller, python) {
    let agent = null;
    const early = [];
    const receive = (operation, key, payload) => {
        if (operation === "A") exit("the connection to the world is lost");
        if (!agent) {
            early.push([operation, key, payload]);
            return;
        }
        const message = bus.open(key, "ToAgent", payload);
        if (!message) return;
        if (message.name === "End") process.exit(0);
        else if (message.name === "Dismissed" && message.content === agent.me.incarnation) exit("dismissed");
        else if (message.name === "Tick") agent.receiveTick(message.content);
    };
    const bus = new Bus(await findRun(run), robot, python, receive);
    bus.send("S", `${bus.prefix}/robot/${robot}/tick`);
    bus.send("A", `${bus.prefix}/alive/world`);
    const welcome = await join(bus, robot);
    agent = new Agent(bus, robot, controllers[controller], welcome);
    const alive = `${bus.prefix}/alive/${robot}/${welcome.incarnation}`;
    bus.send("T", `${alive}/${bus.mark(alive).toString(16).padStart(16, "0")}`);
    for (const message of early) receive(...message);
}

const words = process.argv.slice(2);
if (words[0] === "--check") {
    check();
} else {
    const option = (name, usual) => (words.includes(name) ? words[words.indexOf(name) + 1] : usual);
    const robot = option("--robot", process.env.ALLIANCE_ROBOT);
    const run = option("--run", words.includes("--robot") ? undefined : process.env.ALLIANCE_RUN);
    process.on("SIGTERM", () => process.exit(0));
    await live(robot, run, option("--controller", "still"), option("--python", "python3"));
}
