// Checks of the encoding, the seals and the draws against docs/wire.vectors.json.

import assert from "node:assert/strict";

import { decode, encode, readDocument, schema, toJson } from "./codec.mjs";
import { chacha8, robotSecret, seal, sealBytes, sealKey } from "./seals.mjs";

const hex = (bytes) => Buffer.from(bytes).toString("hex");

/** Compares a decoded value with one of JSON, in which an f32 has as few digits as possible, and NaN is null. */
function same(found, expected, at) {
    if (typeof found === "number" && !Number.isFinite(found)) {
        assert.equal(expected, null, at);
    } else if (typeof found === "number") {
        assert.ok(found === expected || found === Math.fround(expected), `${at}: ${found} is not ${expected}`);
    } else if (found && typeof found === "object") {
        assert.deepEqual(Object.keys(found), Object.keys(expected), at);
        for (const [key, value] of Object.entries(found)) same(value, expected[key], `${at}.${key}`);
    } else {
        assert.equal(found, expected, at);
    }
}

/** Checks all test vectors, and prints their number. */
export function check() {
    const { messages, missions, seals, draws } = readDocument("wire.vectors.json");
    for (const { type, name, hex: text, value } of [...messages, ...missions]) {
        const decoded = decode(type, Buffer.from(text, "hex"));
        assert.equal(hex(encode(type, decoded)), text, name);
        same(toJson(type, decoded), value, name);
    }
    for (const { name, token, secret, key, message, sealed } of seals) {
        const bytes = Buffer.from(message, "hex");
        const robot = key.split("/")[3];
        assert.equal(secret, robotSecret(token, robot), name);
        assert.equal(hex(Buffer.concat([bytes, sealBytes(seal(sealKey(secret), key, bytes))])), sealed, name);
    }
    for (const { seed, stream, block, words } of draws) {
        assert.deepEqual(chacha8(BigInt(seed), BigInt(stream), BigInt(block)), words);
    }
    const count = messages.length + missions.length + seals.length + draws.length;
    process.stdout.write(`${count} vectors of version ${schema.version} match\n`);
}
