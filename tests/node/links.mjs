// Effects of links on received messages, as the section "Effects of links" of docs/WIRE.md specifies them.

import { decode, encode, schema } from "./codec.mjs";
import { chacha8 } from "./seals.mjs";

/** The maximum number of kept messages. */
const CAPACITY = 4096;

const KINDS = schema.types.BroadcastKind.enum.map(({ name }) => name);

const kindOf = ({ name, content }) => (name === "Bulletin" ? `${content.kind.name}Bulletin` : name);

const variant = (name) => ({ name, content: null });

/** Orders broadcasts by sender, incarnation, number and index. */
export function order(one, other) {
    const fields = ["sender", "incarnation", "seq", "index"];
    const field = fields.find((name) => one[name] !== other[name]);
    return field ? Number(BigInt(one[field]) - BigInt(other[field])) : 0;
}

/** Returns the part of a broadcast that is logged. */
function summary(broadcast) {
    const { name, content } = broadcast.body;
    const found = { seq: broadcast.seq, kind: variant(kindOf(broadcast.body)), state: null, since: null, set: null, task: null, progress: null };
    if (name === "Heartbeat") {
        const { state, since, set, task, progress } = content;
        return { ...found, state, since, set, task, progress };
    }
    return name === "Bulletin" ? { ...found, ...content.about } : found;
}

function reception(of, delivery, at, broadcast, stepMs) {
    const content = broadcast ? summary(broadcast) : null;
    return { at, sender: of.sender, incarnation: of.incarnation, sent: of.tick * stepMs, delivery: variant(delivery), content };
}

/** The messages in flight to one robot. A step changes a copy. */
export class Links {
    constructor(rank, seed, stepMs) {
        Object.assign(this, { rank, seed, stepMs, kept: [], copies: [] });
    }

    copy() {
        const copy = new Links(this.rank, this.seed, this.stepMs);
        copy.kept = this.kept.map((message) => ({ ...message }));
        copy.copies = [...this.copies];
        return copy;
    }

    /**
     * Returns the broadcasts that are received in a tick, in order, and the receptions for the report. `arrived` has the
     * entries of the manifest, each with its broadcasts, or undefined for a missing one.
     */
    receive(tick, arrived) {
        const { now } = tick;
        const copies = this.copies.filter(({ at }) => at === now);
        this.copies = [];
        const received = [];
        const late = this.release(tick, received);
        const listed = [];
        for (const [entry, broadcasts] of arrived) {
            const counts = {};
            for (const broadcast of broadcasts) {
                if (!broadcast) {
                    listed.push(reception(entry, "Lost", now, null, this.stepMs));
                    continue;
                }
                const kind = kindOf(broadcast.body);
                const index = counts[kind] ?? 0;
                counts[kind] = index + 1;
                listed.push(this.deliver(entry.link, broadcast, KINDS.indexOf(kind), index, now, received));
            }
        }
        received.sort(order);
        for (const message of this.kept) {
            const overtakes = (other) => other.sender === message.broadcast.sender && order(other, message.broadcast) > 0;
            if (message.wait === "overtaken" && received.some(overtakes)) {
                message.wait = "due";
                message.due = Math.max(message.due, now + this.stepMs);
            }
        }
        return [received, [...listed, ...late, ...copies]];
    }

    /** Ends the waits that are over, and returns their receptions. */
    release({ now, held }, received) {
        const receptions = [];
        this.kept = this.kept.filter((message) => {
            if (message.wait === "held" && !held.includes(message.broadcast.sender)) Object.assign(message, { wait: "due", due: now });
            if (message.wait !== "due" || message.due > now) return true;
            const { broadcast, due, isDamaged } = message;
            const delivery = due < now ? "Cut" : isDamaged ? "Damaged" : "Delayed";
            receptions.push(reception(broadcast, delivery, due, broadcast, this.stepMs));
            if (delivery !== "Cut") this.accept(message, due, received);
            return false;
        });
        return receptions;
    }

    accept({ broadcast, isDoubled }, at, received) {
        received.push(broadcast);
        if (isDoubled) this.copies.push(reception(broadcast, "Duplicate", at + this.stepMs, broadcast, this.stepMs));
    }

    /** Applies a link to a broadcast that has arrived, and returns the reception. */
    deliver(link, broadcast, kind, index, now, received) {
        const result = (delivery, at = now, of = broadcast) => reception(of, delivery, at, of, this.stepMs);
        if (!link) {
            received.push(broadcast);
            return result("Received");
        }
        const { sender, tick } = broadcast;
        const block = (BigInt(tick) << 19n) | (BigInt(kind) << 16n) | BigInt(index);
        const path = (BigInt(sender) << 16n) | BigInt(this.rank);
        const [drop, jitter, duplicate, reorder, fade] = chacha8(this.seed, (3n << 32n) | path, block);
        if (link.cut) return result("Cut");
        if (link.blocked) return result("Blocked");
        if (fade < link.fade) return result("Faded");
        if (drop < link.drop) return result("Dropped");
        const message = { broadcast, isDoubled: duplicate < link.duplicate, isDamaged: false, wait: null, due: now };
        if (link.corrupt && !this.damage(message, link, (10n << 32n) | path, block << 17n)) return result("Corrupted");
        const share = Number((BigInt(link.jitter + 1) * BigInt(jitter)) >> 32n);
        const due = now + Math.ceil((link.delay + share) / this.stepMs) * this.stepMs;
        const waits = this.kept.some((other) => other.wait === "overtaken" && other.broadcast.sender === sender);
        if (link.hold) message.wait = "held";
        else if (reorder < link.reorder && !waits) Object.assign(message, { wait: "overtaken", due });
        else if (due > now) Object.assign(message, { wait: "due", due });
        if (!message.wait) {
            this.accept(message, now, received);
            return result(message.isDamaged ? "Damaged" : "Received", now, message.broadcast);
        }
        if (this.kept.length >= CAPACITY) return result("Dropped");
        this.kept.push(message);
        return result("Pending", message.wait === "due" ? due : now, message.broadcast);
    }

    /** Flips bits of the payload. Returns false if the receiver drops the message. */
    damage(message, link, stream, firstBlock) {
        const payload = encode("BroadcastContent", message.broadcast.body);
        let words = [];
        let flips = 0;
        for (let bit = 0; ; bit += 1) {
            if (flips % 16 === 0) words = chacha8(this.seed, stream, firstBlock + BigInt(flips / 16));
            bit += intactBits(words[flips % 16], link.corrupt);
            if (bit >= 8 * payload.length) break;
            payload[bit >> 3] ^= 1 << (bit & 7);
            flips += 1;
        }
        if (!flips) return true;
        try {
            message.broadcast = { ...message.broadcast, body: decode("BroadcastContent", payload) };
        } catch {
            return false;
        }
        message.isDamaged = true;
        return !link.checksum;
    }
}

/** Returns the number of intact bits before the next flip, for a word of the stream and the probability of a flip. */
function intactBits(word, flip) {
    const powers = [((1n << 32n) - BigInt(flip)) << 32n];
    while (powers.length < 22) powers.push(powers.at(-1) ** 2n >> 64n);
    let [length, probability] = [0, 1n << 64n];
    for (const [level, power] of [...powers.entries()].reverse()) {
        const longer = (probability * power) >> 64n;
        if (BigInt(word) << 32n < longer) [length, probability] = [length + 2 ** level, longer];
    }
    return length;
}
