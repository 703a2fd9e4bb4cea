// Measures the playground in Chromium beside the native program, in turns: robot-steps per second, the time to the first
// picture from disk, sizes, and large teams. Compares the hashes. Needs chromium, Node.js 20, the program and
// the page:
//   cargo build --release --package launch && playground/build &&
//   node --experimental-websocket tests/benches/playground.mjs target/release/alliance target/playground/index.html
import { spawnSync } from "node:child_process";
import { readFileSync, readdirSync } from "node:fs";
import { loadavg } from "node:os";
import { resolve } from "node:path";
import { deflateSync, gzipSync, inflateSync } from "node:zlib";
import { sleep, until, withChromium } from "./chromium.mjs";

const [program, page] = process.argv.slice(2).map((path) => resolve(path));
const WINDOW = [1280, 800];
/** The number of runs of each program. */
const RUNS = 3;
const [SCENARIO, ROBOTS] = ["foraging", 20];
/** Before this tick, the browser compiles the module. */
const WARM_TICK = 4000;
/**
 * Large teams, their speed, times real time, the range of their radio, m, without which all robots receive all messages, and
 * the time of their measurement, ms. In a range of 5.5 m, a robot has 20 neighbors.
 */
const TEAMS = [{ robots: 300, speed: 4 }, { robots: 1000, speed: 1 }, { robots: 1000, speed: 1, range_m: 5.5 }];
const TEAM_MS = 15_000;
/** The unit of processor times in /proc, s. */
const PROCESSOR_TICK_S = Number(spawnSync("getconf", ["CLK_TCK"]).stdout) ** -1;

/** Returns the median of three or more numbers, and the smallest and largest one. */
function spread(numbers, digits = 0) {
  const sorted = numbers.toSorted((a, b) => a - b);
  const [middle, least, most] = [sorted[Math.floor(sorted.length / 2)], sorted[0], sorted.at(-1)].map((each) => each.toFixed(digits));
  return `${middle} [${least} .. ${most}]`;
}
const thousands = (steps, seconds) => steps / seconds / 1000;

/** Runs the native program. Returns its speeds, thousand robot-steps per second, and its hash. */
function native() {
  const command = `TIMEFORMAT="%R %U %S"; cd "$(mktemp -d)"; time "${program}" run ${SCENARIO} --in-process --log off --no-page --out run >report 2>messages`;
  const { stdout, stderr } = spawnSync("bash", ["-c", `${command}; cat run/run.json`], { encoding: "utf8" });
  const [wall, user, system] = stderr.trim().split(/\s+/).slice(-3).map(Number);
  const { hash, result } = JSON.parse(stdout);
  const steps = ROBOTS * result.ticks;
  return { hash, processor: thousands(steps, user + system), wall: thousands(steps, wall) };
}

/** Returns the processor time of the threads of a process by name, s. */
function threads(pid) {
  const found = { main: 0, worker: 0 };
  for (const thread of readdirSync(`/proc/${pid}/task`)) {
    const [, name, rest] = readFileSync(`/proc/${pid}/task/${thread}/stat`, "utf8").match(/\((.*)\) (.*)/);
    const [user, system] = rest.split(" ").slice(11, 13).map(Number);
    const kind = name.startsWith("DedicatedWorker") ? "worker" : Number(thread) === pid ? "main" : null;
    if (kind) found[kind] += (user + system) * PROCESSOR_TICK_S;
  }
  return found;
}

/** Returns the scenario of a large team, like `alliance run --robots`. */
const teamOf = ({ robots, range_m }) => `name = "team"
room = { width_m = 80, height_m = 60 }
${range_m ? `radio = { range_m = ${range_m} }` : ""}

[waste]
border_known = true

[[robots]]
name = "r"
side_sensor = true
count = ${robots}
`;

/** Returns the link of a scenario file, as of launch/page/model/choice.js. */
const linkOf = (text) => `#file=${deflateSync(JSON.stringify({ name: "team.toml", text })).toString("base64url")}`;

/** Opens a run in an empty tab. Returns the time to its first picture, ms since the start of the navigation. */
async function open(tab, link) {
  await tab.send("Page.navigate", { url: "about:blank" });
  await tab.send("Page.navigate", { url: `file://${page}${link}` });
  return until(() => tab.evaluate("window.pictureTime ?? 0"));
}

/** Sets `window.pictureTime` and `window.endTime` in each page: the times of the first picture of a run and of its end, ms. */
const TIMES = `(() => {
  const look = () => {
    if (window.alliance?.view) requestAnimationFrame(() => { window.pictureTime = performance.now(); });
    else requestAnimationFrame(look);
  };
  requestAnimationFrame(look);
  new MutationObserver(() => {
    if (document.body?.dataset.state === "ended") window.endTime ??= performance.now();
  }).observe(document, { subtree: true, attributeFilter: ["data-state"] });
})()`;

const press = async (tab, key) => {
  for (const type of ["keyDown", "keyUp"]) await tab.send("Input.dispatchKeyEvent", { type, key, text: type === "keyDown" ? key : undefined });
};

/** Runs the scenario as fast as possible. Returns its speeds as of \`native\`, its hash, and the time to the first picture. */
async function playground(tab, pid) {
  const picture_ms = await open(tab, `#scenario=${SCENARIO}`);
  await press(tab, "m");
  await press(tab, " ");
  const look = async () => {
    const [tick, now_ms, ended_ms] = await tab.evaluate("[Number(document.body.dataset.tick), performance.now(), window.endTime ?? 0]");
    return { tick, now_ms, ended_ms, used: threads(pid) };
  };
  const from = await until(async () => {
    const found = await look();
    return found.tick >= WARM_TICK && found;
  });
  const last = await until(async () => {
    const found = await look();
    return found.ended_ms > 0 && found;
  }, 600);
  const steps = ROBOTS * (last.tick - from.tick);
  const wall_s = (last.ended_ms - from.now_ms) / 1000;
  return {
    picture_ms,
    hash: await tab.evaluate("document.querySelector('#run-hash').textContent.replace('hash ', '')"),
    processor: thousands(steps, last.used.worker - from.used.worker),
    wall: thousands(steps, wall_s),
    page: (last.used.main - from.used.main) / wall_s,
  };
}

/** Counts the pictures of the room in `window.pictures`, each of another view. */
const COUNT = `(() => {
  window.pictures = 0;
  let shown = alliance.view;
  const look = () => {
    if (alliance.view !== shown) pictures += 1;
    shown = alliance.view;
    requestAnimationFrame(look);
  };
  look();
})()`;

/**
 * Runs a team at a speed. Returns the achieved speed, the rate of pictures, and the processor time that worker and page need
 * for a simulated second, s.
 */
async function team(tab, pid, { robots, speed, range_m }) {
  await open(tab, linkOf(teamOf({ robots, range_m })));
  await tab.evaluate(`(() => {
    const slider = document.querySelector("#speed");
    slider.value = Math.log10(${speed});
    for (const type of ["input", "change"]) slider.dispatchEvent(new Event(type, { bubbles: true }));
  })()`);
  await press(tab, " ");
  await sleep(2000);
  await tab.evaluate(COUNT);
  const look = async () => ({ ...(await tab.evaluate("({ now_ms: alliance.view.now, wall_ms: performance.now(), pictures })")), used: threads(pid) });
  const from = await look();
  await sleep(TEAM_MS);
  const to = await look();
  const [simulated_ms, wall_ms] = [to.now_ms - from.now_ms, to.wall_ms - from.wall_ms];
  const used = (name) => ((to.used[name] - from.used[name]) / simulated_ms) * 1000;
  return { achieved: simulated_ms / wall_ms, per_s: ((to.pictures - from.pictures) / wall_ms) * 1000, worker: used("worker"), page: used("main") };
}

/** Returns the sizes of the page and of the module inside it, bytes. */
function sizes() {
  const text = readFileSync(page, "utf8");
  const packed = Buffer.from(text.match(/data-part="engine"[^>]*>([^<]*)</)[1], "base64");
  const module = inflateSync(packed);
  return { module: module.length, module_gzip: gzipSync(module, { level: 9 }).length, page: text.length, page_gzip: gzipSync(text, { level: 9 }).length };
}

const megabytes = (bytes) => `${(bytes / 1e6).toFixed(2)} MB`;
const load = () => loadavg()[0].toFixed(1);

await withChromium(WINDOW, async (tab, browser) => {
  await tab.send("Page.enable");
  await tab.send("Page.addScriptToEvaluateOnNewDocument", { source: TIMES });
  const loads = [load()];
  const [natives, pages] = [[], []];
  let pid = null;
  for (let run = 0; run < RUNS; run += 1) {
    natives.push(native());
    await open(tab, "");
    const { processInfo } = await browser.send("SystemInfo.getProcessInfo");
    // Chromium has other renderers, too.
    const renderers = processInfo.filter(({ type }) => type === "renderer").map(({ id }) => id);
    [pid] = renderers.toSorted((a, b) => threads(b).worker - threads(a).worker);
    pages.push(await playground(tab, pid));
    loads.push(load());
  }
  const hashes = new Set([...natives, ...pages].map(({ hash }) => hash));
  const { module, module_gzip, page: whole, page_gzip } = sizes();
  const row = (name, found) => `| ${name} | ${spread(found.map(({ processor }) => processor))} | ${spread(found.map(({ wall }) => wall))} |`;
  console.log(`module ${megabytes(module)}, ${megabytes(module_gzip)} with gzip; page ${megabytes(whole)}, ${megabytes(page_gzip)} with gzip`);
  console.log(`first picture from disk: ${spread(pages.map(({ picture_ms }) => picture_ms / 1000), 2)} s`);
  console.log(`${SCENARIO}, thousand robot-steps per second, load ${loads.join(", ")}`);
  console.log("| | processor time | wall clock |\n|---|---|---|");
  console.log(row("native", natives));
  console.log(row("Chromium", pages));
  console.log(`the page's main thread: ${spread(pages.map(({ page: used }) => used), 2)} of a core`);
  console.log(hashes.size === 1 ? `equal hashes: ${[...hashes][0]}` : `DIFFERENT HASHES: ${[...hashes].join(", ")}`);
  console.log(`teams, load ${load()}, processor time in s per simulated second`);
  console.log("| robots | range | speed | achieved | pictures per second | worker | page |\n|---|---|---|---|---|---|---|");
  for (const each of TEAMS) {
    const found = await team(tab, pid, each);
    const [achieved, worker, used] = [found.achieved, found.worker, found.page].map((value) => value.toFixed(2));
    console.log(`| ${each.robots} | ${each.range_m ?? "all"} | ${each.speed}x | ${achieved}x | ${found.per_s.toFixed(1)} | ${worker} | ${used} |`);
  }
  process.exitCode = hashes.size === 1 ? 0 : 1;
});
process.exit();
