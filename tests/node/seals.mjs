// Seals and random draws, as docs/WIRE.md specifies them.

import { createHmac } from "node:crypto";

const MASK = (1n << 64n) - 1n;

const rotated = (word, bits) => ((word << bits) | (word >> (64n - bits))) & MASK;

const words = (bytes) => {
    const view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
    return Array.from({ length: bytes.length >> 3 }, (_, place) => view.getBigUint64(8 * place, true));
};

/** Returns SipHash-2-4 of the bytes. The key has two words. */
export function sipHash([k0, k1], bytes) {
    let [a, b, c, d] = [k0 ^ 0x736f6d6570736575n, k1 ^ 0x646f72616e646f6dn, k0 ^ 0x6c7967656e657261n, k1 ^ 0x7465646279746573n];
    const round = () => {
        a = (a + b) & MASK;
        b = rotated(b, 13n) ^ a;
        a = rotated(a, 32n);
        c = (c + d) & MASK;
        d = rotated(d, 16n) ^ c;
        a = (a + d) & MASK;
        d = rotated(d, 21n) ^ a;
        c = (c + b) & MASK;
        b = rotated(b, 17n) ^ c;
        c = rotated(c, 32n);
    };
    const padded = new Uint8Array((bytes.length & ~7) + 8);
    padded.set(bytes);
    padded[padded.length - 1] = bytes.length & 255;
    for (const word of words(padded)) {
        d ^= word;
        round();
        round();
        a ^= word;
    }
    c ^= 255n;
    for (let count = 0; count < 4; count += 1) round();
    return a ^ b ^ c ^ d;
}

/** The first words of XXH3's default secret. */
const [S0, S1, S2, S3] = words(Buffer.from("b8fe6c3923a44bbe7c01812cf721ad1cded46de9839097db7240a4a4b7b3671f", "hex"));

/** Returns the key of the seals of a secret: XXH3 with 128 bits, of a text of 17 to 32 bytes. */
export function sealKey(secret) {
    const bytes = Buffer.from(secret, "utf8");
    if (bytes.length < 17 || bytes.length > 32) throw new Error("a secret has 32 characters");
    const [b0, b1] = words(Uint8Array.from(bytes.subarray(0, 16)));
    const [e0, e1] = words(Uint8Array.from(bytes.subarray(-16)));
    const folded = (one, other) => ((one * other) & MASK) ^ ((one * other) >> 64n);
    const avalanche = (hash) => {
        const mixed = ((hash ^ (hash >> 37n)) * 0x165667919e3779f9n) & MASK;
        return mixed ^ (mixed >> 32n);
    };
    const [P1, P2, P4] = [0x9e3779b185ebca87n, 0xc2b2ae3d27d4eb4fn, 0x85ebca77c2b2ae63n];
    const length = BigInt(bytes.length);
    const low = ((length * P1 + folded(b0 ^ S0, b1 ^ S1)) & MASK) ^ ((e0 + e1) & MASK);
    const high = folded(e0 ^ S2, e1 ^ S3) ^ ((b0 + b1) & MASK);
    return [avalanche((low + high) & MASK), -avalanche((low * P1 + high * P4 + length * P2) & MASK) & MASK];
}

/** Returns the secret of a robot. */
export const robotSecret = (token, robot) => createHmac("sha256", token).update(`robot-${robot}`).digest("hex").slice(0, 32);

/** Returns the seal of a message for a key expression. */
export function seal(key, expression, message) {
    return sipHash(key, Buffer.concat([Buffer.from(expression, "utf8"), Buffer.from([0]), message]));
}

/** Returns a seal as the bytes that follow the message. */
export function sealBytes(number) {
    const bytes = Buffer.alloc(8);
    bytes.writeBigUInt64LE(number);
    return bytes;
}

/** Expands a seed to the key of ChaCha. */
function chachaKey(seed) {
    let state = BigInt(seed);
    return Array.from({ length: 8 }, () => {
        state = (state * 6364136223846793005n + 11634580027462260723n) & MASK;
        const word = Number((((state >> 18n) ^ state) >> 27n) & 0xffffffffn);
        const turns = Number(state >> 59n);
        return ((word >>> turns) | (word << ((32 - turns) & 31))) >>> 0;
    });
}

const turned = (word, bits) => (word << bits) | (word >>> (32 - bits));

/** Returns the 16 words of a block of ChaCha8. */
export function chacha8(seed, stream, block) {
    const halves = [block, stream].flatMap((number) => [BigInt(number) & 0xffffffffn, BigInt(number) >> 32n].map(Number));
    const first = Uint32Array.from([0x61707865, 0x3320646e, 0x79622d32, 0x6b206574, ...chachaKey(seed), ...halves]);
    const v = Uint32Array.from(first);
    const quarter = (a, b, c, d) => {
        for (const [to, from, other, bits] of [[a, b, d, 16], [c, d, b, 12], [a, b, d, 8], [c, d, b, 7]]) {
            v[to] += v[from];
            v[other] = turned(v[other] ^ v[to], bits);
        }
    };
    for (let count = 0; count < 4; count += 1) {
        for (let i = 0; i < 4; i += 1) quarter(i, 4 + i, 8 + i, 12 + i);
        for (let i = 0; i < 4; i += 1) quarter(i, 4 + ((i + 1) % 4), 8 + ((i + 2) % 4), 12 + ((i + 3) % 4));
    }
    return Array.from(v, (word, place) => (word + first[place]) >>> 0);
}
