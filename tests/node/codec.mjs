// Encoding of messages by docs/wire.schema.json, as docs/WIRE.md specifies it. A struct becomes an object, a variant
// `{ name, content }`, an option null or the value, and an option of an option null or a list of one entry. Integers
// above 2^53 are BigInt.

import { readFileSync } from "node:fs";

const docs = new URL("../../docs/", import.meta.url);

/** The schema of the messages. */
export const schema = JSON.parse(readFileSync(new URL("wire.schema.json", docs), "utf8"));

/** Reads another file of the folder docs. */
export const readDocument = (name) => JSON.parse(readFileSync(new URL(name, docs), "utf8"));

const UTF8 = new TextDecoder("utf-8", { fatal: true, ignoreBOM: true });

const isOption = (type) => typeof type === "object" && "option" in type;

/** Returns the only key of a description, and its value. */
const form = (type) => Object.entries(type)[0];

class Reader {
    constructor(bytes) {
        this.bytes = bytes;
        this.at = 0;
    }

    take(length) {
        if (this.at + length > this.bytes.length) throw new Error("the message ends too early");
        this.at += length;
        return this.bytes.subarray(this.at - length, this.at);
    }

    number(bits = 64) {
        const [first] = this.take(1);
        if (first <= 250 || bits === 8) return first;
        const width = 2 << (first - 251);
        if (first === 255 || 8 * width > bits) throw new Error("the number is too wide");
        const value = this.take(width).reduceRight((high, byte) => (high << 8n) | BigInt(byte), 0n);
        return value <= BigInt(Number.MAX_SAFE_INTEGER) ? Number(value) : value;
    }

    flag() {
        const [first] = this.take(1);
        if (first > 1) throw new Error("neither 0 nor 1");
        return first === 1;
    }

    value(type) {
        if (typeof type === "object") return this[form(type)[0]](form(type)[1]);
        if (type in schema.types) return this.value(schema.types[type]);
        switch (type) {
            case "bool":
                return this.flag();
            case "f32":
                return Buffer.from(this.take(4)).readFloatLE();
            case "f64":
                return Buffer.from(this.take(8)).readDoubleLE();
            case "text":
                return UTF8.decode(this.take(Number(this.number())));
            case "bytes":
                return Uint8Array.from(this.take(Number(this.number())));
            default:
                return this.number(Number(type.slice(1)));
        }
    }

    struct(fields) {
        return Object.fromEntries(fields.map(({ name, type }) => [name, this.value(type)]));
    }

    enum(variants) {
        const variant = variants[this.number(32)];
        if (!variant) throw new Error("no such variant");
        return { name: variant.name, content: variant.content && this.value(variant.content) };
    }

    option(type) {
        if (!this.flag()) return null;
        return isOption(type) ? [this.value(type)] : this.value(type);
    }

    list(type) {
        const length = Number(this.number());
        if (length > schema.limits.message) throw new Error("the list is too long");
        return Array.from({ length }, () => this.value(type));
    }

    tuple(types) {
        return types.map((type) => this.value(type));
    }
}

/** Decodes a message that fills the bytes. */
export function decode(type, bytes) {
    const reader = new Reader(bytes);
    const value = reader.value(type);
    if (reader.at < bytes.length) throw new Error("bytes after the message");
    return value;
}

/** Decodes a message, or returns null if that is impossible. */
export function decodeOrNull(type, bytes) {
    try {
        return decode(type, bytes);
    } catch {
        return null;
    }
}

function numberBytes(value) {
    const number = BigInt(value);
    if (number <= 250n) return [Number(number)];
    const marker = [16n, 32n, 64n, 128n].findIndex((bits) => number >> bits === 0n);
    const bytes = Array.from({ length: 2 << marker }, (_, place) => Number((number >> BigInt(8 * place)) & 255n));
    return [251 + marker, ...bytes];
}

function write(type, value, bytes) {
    if (typeof type === "object") {
        const [kind, parts] = form(type);
        if (kind === "struct") {
            for (const part of parts) write(part.type, value[part.name], bytes);
        } else if (kind === "tuple") {
            parts.forEach((part, place) => write(part, value[place], bytes));
        } else if (kind === "list") {
            bytes.push(...numberBytes(value.length));
            for (const entry of value) write(parts, entry, bytes);
        } else if (kind === "option") {
            bytes.push(value === null ? 0 : 1);
            if (value !== null) write(parts, isOption(parts) ? value[0] : value, bytes);
        } else {
            const index = parts.findIndex(({ name }) => name === value.name);
            bytes.push(...numberBytes(index));
            if (parts[index].content) write(parts[index].content, value.content, bytes);
        }
    } else if (type in schema.types) {
        write(schema.types[type], value, bytes);
    } else if (type === "text" || type === "bytes") {
        const data = type === "text" ? Buffer.from(value, "utf8") : value;
        bytes.push(...numberBytes(data.length), ...data);
    } else if (type === "f32" || type === "f64") {
        const data = Buffer.alloc(type === "f32" ? 4 : 8);
        type === "f32" ? data.writeFloatLE(value) : data.writeDoubleLE(value);
        bytes.push(...data);
    } else if (type === "bool" || type === "u8") {
        bytes.push(Number(value));
    } else {
        bytes.push(...numberBytes(value));
    }
}

/** Encodes a message. */
export function encode(type, value) {
    const bytes = [];
    write(type, value, bytes);
    return Uint8Array.from(bytes);
}

/** Returns a decoded value in the JSON of the test vectors. */
export function toJson(type, value) {
    if (typeof type === "string" && type in schema.types) return toJson(schema.types[type], value);
    if (typeof type === "string") {
        if (type === "bytes") return Array.from(value);
        return typeof value === "bigint" ? Number(value) : value;
    }
    const [kind, parts] = form(type);
    if (kind === "option") return value === null ? null : toJson(parts, isOption(parts) ? value[0] : value);
    if (kind === "list") return value.map((entry) => toJson(parts, entry));
    if (kind === "tuple") return parts.length ? parts.map((part, place) => toJson(part, value[place])) : null;
    if (kind === "struct") {
        if (!parts.length) return null;
        return Object.fromEntries(parts.map((part) => [part.name, toJson(part.type, value[part.name])]));
    }
    const { content } = parts.find(({ name }) => name === value.name);
    return content ? { [value.name]: toJson(content, value.content) } : value.name;
}
