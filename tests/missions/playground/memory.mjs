// Prints the memory of the playground's module before a run and after its first messages, bytes: memory.mjs MODULE WORKER CHOICE.

import { readFileSync } from "node:fs";
import { pathToFileURL } from "node:url";

/** The ticks of two waves of messages in the mission waste: at the start, and after 10 s. */
const TICKS = 205;

const [module, worker, choice] = process.argv.slice(2);
const { Program } = await import(pathToFileURL(worker));
const { instance } = await WebAssembly.instantiate(readFileSync(module), {});
const program = new Program(instance.exports);
const bytes = () => instance.exports.memory.buffer.byteLength;
program.list();
program.open(JSON.parse(choice), 0);
const start = bytes();
program.control({ clock: { speed: null } }, 0);
program.control({ clock: { step: TICKS } }, 0);
while (program.advance(0, 1000) !== Infinity);
console.log(JSON.stringify({ start, end: bytes() }));
