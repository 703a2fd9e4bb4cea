// Prints the results of a plan in Node.js: node.mjs MODULE WORKER PLAN.

import { readFileSync } from "node:fs";
import { pathToFileURL } from "node:url";
import { results } from "./hashes.mjs";

const [module, worker, plan] = process.argv.slice(2);
const { Program } = await import(pathToFileURL(worker));
console.log(JSON.stringify(await results(readFileSync(module), Program, JSON.parse(readFileSync(plan, "utf8")))));
