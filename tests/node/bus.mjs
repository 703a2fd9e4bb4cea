// The bus of a run: zenoh by the relay tests/python/relay.py, because npm has no zenoh library that works without a
// plugin of the router. The relay forwards bytes; everything else is here.

import { spawn } from "node:child_process";
import { existsSync, readFileSync, readdirSync, statSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { setTimeout as sleep } from "node:timers/promises";
import { fileURLToPath } from "node:url";

import { decodeOrNull, encode } from "./codec.mjs";
import { robotSecret, seal, sealBytes, sealKey } from "./seals.mjs";

const RELAY = fileURLToPath(new URL("../python/relay.py", import.meta.url));

/** Returns the announcement of a live run: of the wanted id, or of the newest run. */
export async function findRun(wanted) {
    const base = process.env.XDG_RUNTIME_DIR ?? "";
    const folder = base && existsSync(base) ? join(base, "alliance") : join(tmpdir(), `alliance-${process.geteuid()}`);
    for (const until = Date.now() + 10_000; Date.now() < until; await sleep(20)) {
        const names = existsSync(folder) ? readdirSync(folder).filter((name) => name.endsWith(".json")) : [];
        const files = names.map((name) => join(folder, name)).filter(existsSync);
        files.sort((one, other) => statSync(other).mtimeMs - statSync(one).mtimeMs);
        const runs = files.map((file) => JSON.parse(readFileSync(file, "utf8")));
        const found = runs.find(({ run, pid }) => (!wanted || run === wanted) && existsSync(`/proc/${pid}`));
        if (found) return found;
    }
    throw new Error("no such run is live");
}

/** A session on the bus, with the keys of a robot. `onMessage(operation, key, payload)` receives the frames. */
export class Bus {
    constructor(run, robot, python, onMessage) {
        this.prefix = `alliance/${run.run}`;
        this.ownKey = sealKey(robotSecret(run.token, robot));
        this.replies = null;
        this.relay = spawn(python, [RELAY], { stdio: ["pipe", "pipe", "inherit"] });
        this.relay.on("exit", () => process.exit(3));
        this.relay.stdin.on("error", () => {});
        let rest = Buffer.alloc(0);
        this.relay.stdout.on("data", (data) => {
            rest = Buffer.concat([rest, data]);
            while (rest.length >= 4 && rest.length >= 4 + rest.readUInt32LE()) {
                const frame = rest.subarray(4, 4 + rest.readUInt32LE());
                rest = rest.subarray(4 + frame.length);
                const end = 3 + frame.readUInt16LE(1);
                this.frame(String.fromCharCode(frame[0]), frame.toString("utf8", 3, end), frame.subarray(end), onMessage);
            }
        });
        this.send("C", "", Buffer.from(JSON.stringify(settings(run))));
    }

    send(operation, key, payload = Buffer.alloc(0)) {
        const name = Buffer.from(key, "utf8");
        const head = Buffer.alloc(7);
        head.writeUInt32LE(3 + name.length + payload.length);
        head.write(operation, 4);
        head.writeUInt16LE(name.length, 5);
        this.relay.stdin.write(Buffer.concat([head, name, payload]));
    }

    frame(operation, key, payload, onMessage) {
        if (operation === "R") this.replies.found.push(payload);
        else if (operation === "E") this.replies.done(this.replies.found);
        else onMessage(operation, key, payload);
    }

    /** Sends a query and returns the payloads of its replies. */
    query(key, payload) {
        return new Promise((done) => {
            this.replies = { found: [], done };
            this.send("Q", key, payload);
        });
    }

    mark(key, message = Buffer.alloc(0)) {
        return seal(this.ownKey, key, message);
    }

    seal(key, type, value) {
        const message = encode(type, value);
        return Buffer.concat([message, sealBytes(this.mark(key, message))]);
    }

    /** Returns a message, or null without a valid seal for this key or if it cannot be decoded. */
    open(key, type, sealed) {
        if (sealed.length < 8) return null;
        const message = sealed.subarray(0, -8);
        if (!sealBytes(this.mark(key, message)).equals(sealed.subarray(-8))) return null;
        return decodeOrNull(type, message);
    }
}

function settings({ team }) {
    return {
        mode: "client",
        "connect/endpoints": [team.endpoint],
        "listen/endpoints": [],
        "transport/auth/usrpwd/user": "team",
        "transport/auth/usrpwd/password": team.password,
        "scouting/multicast/enabled": false,
        "scouting/gossip/enabled": false,
        "timestamping/enabled": false,
        "transport/link/tx/lease": 86_400_000,
    };
}
