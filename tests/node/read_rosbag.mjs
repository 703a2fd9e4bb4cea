// Reads a bag of ROS 2 with the packages with which Foxglove reads it, and encodes each message again. Prints the number
// of messages by type as JSON.
//
//     node read_rosbag.mjs MODULES FILE

import { readFileSync } from "node:fs";
import { createRequire } from "node:module";
import process from "node:process";

const [modules, file] = process.argv.slice(2);
const load = createRequire(`${modules}/`);
const { McapIndexedReader } = load("@mcap/core");
const { parse } = load("@foxglove/rosmsg");
const { MessageReader, MessageWriter } = load("@foxglove/rosmsg2-serialization");
const lz4 = load("@foxglove/wasm-lz4");

await lz4.isLoaded;
const bytes = readFileSync(file);
const readable = {
    size: async () => BigInt(bytes.length),
    read: async (offset, size) => bytes.subarray(Number(offset), Number(offset + size)),
};
const decompressHandlers = { lz4: (data, size) => lz4(data, Number(size)) };
const reader = await McapIndexedReader.Initialize({ readable, decompressHandlers });

const types = new Map();
for (const { id, name, data } of reader.schemasById.values()) {
    const definitions = parse(new TextDecoder().decode(data), { ros2: true });
    types.set(id, { name, reader: new MessageReader(definitions), writer: new MessageWriter(definitions) });
}
const counts = {};
for await (const { channelId, data } of reader.readMessages()) {
    const { topic, schemaId } = reader.channelsById.get(channelId);
    const type = types.get(schemaId);
    const again = type.writer.writeMessage(type.reader.readMessage(data));
    if (Buffer.compare(again, data) !== 0) {
        throw new Error(`${topic}: ${Buffer.from(again).toString("hex")} is not ${Buffer.from(data).toString("hex")}`);
    }
    counts[type.name] = (counts[type.name] ?? 0) + 1;
}
if (BigInt(Object.values(counts).reduce((sum, count) => sum + count, 0)) !== reader.statistics.messageCount) {
    throw new Error(`${JSON.stringify(counts)} is not all of ${reader.statistics.messageCount} messages`);
}
console.log(JSON.stringify(counts));
