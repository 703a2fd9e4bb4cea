// Takes the screenshots of the README and the book anew. A test (tests/missions/pictures.rs) runs this script with the fonts of
// figures and compares the pictures with those in the repository. Needs chromium, Node.js 20, the program, and the page of
// `playground/build`:
//   node --experimental-websocket docs/img/screenshots.mjs target/release/alliance target/playground/index.html [FOLDER]
import { execFileSync, spawn, spawnSync } from "node:child_process";
import { mkdtempSync, readFileSync, rmSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { dirname, join, resolve } from "node:path";
import { fileURLToPath } from "node:url";
import { deflateSync } from "node:zlib";
import { sleep, until, withChromium } from "../../tests/benches/chromium.mjs";

const [program, page] = process.argv.slice(2, 4).map((path) => resolve(path));
const folder = resolve(process.argv[4] ?? dirname(fileURLToPath(import.meta.url)));
const LAPTOP = [1280, 800];
const TABLET = [820, 1180];
const PHONE = [390, 844];
const DESKTOP = [1920, 1080];
/** The simulated time of ten ticks, s. */
const TEN_TICKS_S = 0.5;
/** Green has just reported progress. */
const LIVE_TICK = 2636;

// Gold dies when it picks its first item, as in the gallery.
const KILL = [[0, { fault: { fault: { kill: "gold" }, when: "gold picks" } }]];
const PAIR = `#allocator=grape&beside=cbba&orders=${deflateSync(JSON.stringify(KILL)).toString("base64url")}`;
const EDITED = `name = "waste-cleanup"

[[obstacles]]            # a wall between spills and deposit
x_m = 6.0
y_m = 3.0
width_m = 0.3
height_m = 3.0

[waste]
[[waste.spills]]
name = "top"
items = 12
x_fraction = 0.33
y_fraction = 0.67
[[waste.spills]]
name = "bottom"
items = 12
x_fraction = 0.33
y_fraction = 0.33
[[waste.spills]]
name = "third"
items = 6
x_fraction = 0.75
y_fraction = 0.8

[[robots]]
name = "blue"
side_sensor = true
start = { x_m = 2.0, y_m = 7.0, heading_deg = 0 }
[[robots]]
name = "gold"
[[robots]]
name = "green"
`;

/** Runs to a simulated time, and draws nothing before. */
const runTo = (seconds) => async (tab) => {
  await tab.evaluate(`(() => {
    document.body.hidden = true;
    const press = (key) => document.body.dispatchEvent(new KeyboardEvent("keydown", { key, bubbles: true }));
    press("m");
    for (let step = 0; step < ${seconds / TEN_TICKS_S}; step += 1) press(">");
  })()`);
  await until(() => tab.evaluate(`alliance.view.now === ${1000 * seconds}`), 300);
  await tab.evaluate("document.body.hidden = false");
};

async function edit(tab) {
  await tab.evaluate("document.querySelector('#edit').click()");
  await until(() => tab.evaluate("document.querySelectorAll('#edit-item option').length > 1"));
  await tab.evaluate(`(() => {
    const field = document.querySelector("#edit-text");
    field.value = ${JSON.stringify(EDITED)};
    field.dispatchEvent(new Event("input", { bubbles: true }));
  })()`);
  await until(() => tab.evaluate("document.querySelectorAll('#edit-item option').length === 9"));
  await tab.evaluate(`(() => {
    const items = document.querySelector("#edit-item");
    items.value = "obstacle 0";
    items.dispatchEvent(new Event("change", { bubbles: true }));
  })()`);
}

const work = mkdtempSync(join(tmpdir(), "screenshots-"));
const alliance = (...words) => execFileSync(program, words, { cwd: work, stdio: "ignore" });

/** Starts a live run that stops at a tick. Returns its process and the link of its page. */
async function startLive(tick) {
  const run = spawn(program, ["run", "--paused", "--speed", "20x", "--out", "live"], { cwd: work, stdio: ["ignore", "pipe", "pipe"] });
  process.once("exit", () => run.kill("SIGINT"));
  let output = "";
  for (const stream of [run.stdout, run.stderr]) stream.on("data", (text) => { output += text; });
  const url = await until(() => output.match(/^page (http:\S+)/m)?.[1]);
  const id = output.match(/^run (\S+)/m)[1];
  await until(() => spawnSync(program, ["status", "--run", id]).status === 0, 300);
  alliance("clock", "step", `${tick}`, "--run", id);
  return { run, url };
}

/** Waits for a tick of the live run. */
const liveAt = (tick) => (tab) => until(() => tab.evaluate(`document.body.dataset.tick === "${tick}"`), 300);

/** Replaces the ids of the live run's processes, which differ from run to run. */
const hidePids = (tab) => tab.evaluate(`(() => {
  const pids = [alliance.run.run.match(/\\d+$/)[0], ...alliance.view.robots.map(({ pid }) => String(pid))];
  const texts = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
  while (texts.nextNode()) {
    const text = texts.currentNode;
    text.data = text.data.replace(/\\d{2,}/, (number) => pids.includes(number) ? 4100 + pids.indexOf(number) : number);
  }
})()`);

// The film of the README shows the same run.
writeFileSync(join(work, "mission.toml"), readFileSync(new URL("make.sh", import.meta.url), "utf8").match(/SCENARIO'\n(.*?)SCENARIO/s)[1]);
alliance("run", "mission.toml", "--in-process", "--out", "gold-dies");
alliance("export", "gold-dies", "--html=gold-dies.html");
const live = await startLive(LIVE_TICK);
const playground = `file://${page}`;

const PICTURES = [
  { name: "page-log", size: LAPTOP, theme: "dark", url: `file://${work}/gold-dies.html#t=128`, act: () => {} },
  { name: "playground", size: LAPTOP, url: playground + PAIR.replace("allocator=grape&beside=cbba&", ""), act: runTo(117) },
  { name: "playground-beside", size: LAPTOP, url: playground + PAIR, act: runTo(145) },
  { name: "playground-phone", size: PHONE, theme: "dark", url: playground + PAIR, act: runTo(145) },
  { name: "playground-gallery", size: TABLET, url: playground, act: (tab) => tab.evaluate("document.querySelector('#open-gallery').click()") },
  { name: "playground-editor", size: DESKTOP, url: playground, act: edit },
  // Last, because its run takes some seconds.
  { name: "page-live", size: LAPTOP, url: live.url, act: liveAt(LIVE_TICK), finish: hidePids },
];

await withChromium(DESKTOP, async (tab) => {
  for (const { name, size, theme = "light", url, act, finish } of PICTURES) {
    const [width, height] = size;
    const mobile = width < 900;
    await tab.send("Emulation.setDeviceMetricsOverride", { width, height, deviceScaleFactor: 1, mobile });
    await tab.send("Emulation.setEmulatedMedia", { features: [{ name: "prefers-color-scheme", value: theme }] });
    // A link that differs only after the # would not load the page again.
    await tab.send("Page.navigate", { url: "about:blank" });
    await tab.send("Page.navigate", { url });
    await until(() => tab.evaluate("document.body?.dataset.state === 'paused'"));
    await act(tab);
    // The notices disappear, and the last picture is drawn.
    await until(() => tab.evaluate("document.querySelectorAll('.notice').length === 0"));
    await sleep(1000);
    await finish?.(tab);
    const { data } = await tab.send("Page.captureScreenshot", { format: "png" });
    writeFileSync(join(folder, `${name}.png`), Buffer.from(data, "base64"));
    console.log(`${name}.png: ${width} x ${height}`);
  }
});
live.run.kill("SIGINT");
await new Promise((done) => live.run.once("exit", done));
rmSync(work, { recursive: true });
process.exit();
