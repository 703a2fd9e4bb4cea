// Measures the page of a finished run with Chromium's tracing: frames per second at real time and at four times that,
// and the time from a click to the next frame. Needs chromium, Node.js 20 and a run folder:
//   node --experimental-websocket tests/benches/page.mjs target/release/alliance FOLDER [PICTURE.png]
import { spawn } from "node:child_process";
import { mkdtempSync, readFileSync, rmSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";

const [program, folder, picture] = process.argv.slice(2);
const PLAY_MS = 10_000;
const FAST = 4; // times real time
const [WIDTH, HEIGHT] = [1600, 1000];
// The elements to click, in order. Missing ones are skipped.
const CLICKS = [
  "#tab-events", "#tab-messages", "#tab-links", "#tab-faults", "#tab-tasks", "#robot-cards [data-action=select]", "#matrix-canvas",
  "#follow", "#show-radio", "#show-rays", "#zoom-in", "#zoom-all",
];

const sleep = (ms) => new Promise((done) => setTimeout(done, ms));

async function until(condition) {
  for (let tries = 0; tries < 600; tries += 1) {
    const found = await condition();
    if (found) return found;
    await sleep(100);
  }
  throw new Error(`timeout: ${condition}`);
}

/** Connects to a tab's DevTools: `send` sends a request, `events` has the received events. */
async function connect(url) {
  const socket = new WebSocket(url);
  await new Promise((done, failed) => { socket.onopen = done; socket.onerror = failed; });
  const answers = new Map();
  const events = [];
  let last = 0;
  socket.onmessage = ({ data }) => {
    const message = JSON.parse(data);
    if (message.id) answers.get(message.id)(message);
    else events.push(message);
  };
  const send = (method, params = {}) => new Promise((done, failed) => {
    last += 1;
    answers.set(last, ({ result, error }) => (error ? failed(new Error(`${method}: ${error.message}`)) : done(result)));
    socket.send(JSON.stringify({ id: last, method, params }));
  });
  return { send, events, close: () => socket.close() };
}

const middle = (numbers) => numbers.toSorted((a, b) => a - b)[Math.floor(numbers.length / 2)];

const profile = mkdtempSync(join(tmpdir(), "page-"));
const view = spawn(program, ["watch", folder], { stdio: ["ignore", "ignore", "pipe"] });
let output = "";
view.stderr.on("data", (data) => (output += data));
const browser = spawn("chromium", [
  "--headless=new", "--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage", "--no-first-run", "--disable-background-networking",
  "--remote-debugging-port=0", `--user-data-dir=${profile}`, `--window-size=${WIDTH},${HEIGHT}`, "about:blank",
], { stdio: "ignore" });
try {
  const link = await until(() => output.match(/http:\S+#\S+/)?.[0]);
  const port = await until(() => {
    try { return readFileSync(join(profile, "DevToolsActivePort"), "utf8").split("\n")[0]; } catch { return null; }
  });
  const tabs = await until(() => fetch(`http://127.0.0.1:${port}/json`).then((response) => response.json(), () => null));
  const tab = await connect(tabs.find(({ type }) => type === "page").webSocketDebuggerUrl);
  const evaluate = async (expression) => (await tab.send("Runtime.evaluate", { expression, returnByValue: true })).result.value;
  await tab.send("Emulation.setDeviceMetricsOverride", { width: WIDTH, height: HEIGHT, deviceScaleFactor: 1, mobile: false });
  await tab.send("Page.navigate", { url: link });
  await until(() => evaluate("!!window.alliance?.view"));
  const elements = await evaluate("document.querySelectorAll('*').length");

  await tab.send("Tracing.start", {
    transferMode: "ReportEvents",
    traceConfig: { includedCategories: ["blink.user_timing", "devtools.timeline", "disabled-by-default-devtools.timeline.frame", "disabled-by-default-devtools.timeline"] },
  });
  const press = async (x, y) => {
    for (const type of ["mousePressed", "mouseReleased"]) await tab.send("Input.dispatchMouseEvent", { type, x, y, button: "left", clickCount: 1 });
  };
  await evaluate("performance.mark('plays'); document.querySelector('#pause').click()");
  await sleep(PLAY_MS);
  await evaluate(`performance.mark('faster'); const slider = document.querySelector('#speed'); slider.value = Math.log10(${FAST});
    for (const type of ["input", "change"]) slider.dispatchEvent(new Event(type, { bubbles: true }))`);
  await sleep(PLAY_MS);
  await evaluate("performance.mark('clicks')");
  const clicked = [];
  for (const selector of CLICKS) {
    const at = await evaluate(`(() => { const element = document.querySelector(${JSON.stringify(selector)}); const box = element?.getBoundingClientRect();
      return box?.width && !element.disabled ? { x: box.x + box.width / 2, y: box.y + box.height / 2 } : null; })()`);
    if (!at) continue;
    clicked.push(selector);
    await press(at.x, at.y);
    await sleep(500);
  }
  const tabOpen = await evaluate("document.querySelectorAll('*').length");
  await tab.send("Tracing.end");
  await until(() => tab.events.some(({ method }) => method === "Tracing.tracingComplete"));
  const trace = tab.events.filter(({ method }) => method === "Tracing.dataCollected").flatMap(({ params }) => params.value);
  if (process.env.TRACE) writeFileSync(process.env.TRACE, JSON.stringify(trace));
  if (picture) {
    const { data } = await tab.send("Page.captureScreenshot", { format: "png" });
    writeFileSync(picture, Buffer.from(data, "base64"));
  }

  const mark = (name) => trace.find((event) => event.name === name && event.cat?.includes("blink.user_timing"))?.ts;
  const drawn = trace.filter(({ name }) => name === "DrawFrame").map(({ ts }) => ts).toSorted((a, b) => a - b);
  const played = (from, to) => {
    const at = drawn.filter((ts) => mark(from) <= ts && ts < mark(to));
    const gaps = at.slice(1).map((ts, index) => (ts - at[index]) / 1000);
    return { per_s: +((1000 * gaps.length) / gaps.reduce((all, each) => all + each, 0)).toFixed(1), longest_ms: Math.round(Math.max(...gaps)) };
  };
  const started = new Map();
  const clicks = [];
  for (const event of trace.filter(({ name }) => name === "EventTiming")) {
    const id = JSON.stringify(event.id2 ?? event.id);
    if (event.ph === "b") started.set(id, event);
    else if (event.ph === "e" && started.has(id)) {
      const { ts, args } = started.get(id);
      if (["pointerdown", "pointerup", "click"].includes(args.data?.type)) clicks.push((event.ts - ts) / 1000);
    }
  }
  console.log(JSON.stringify({
    elements, elements_in_the_end: tabOpen, pictures: played("plays", "faster"), [`pictures_at_${FAST}x`]: played("faster", "clicks"),
    clicks: clicked.length, click_ms: { median: Math.round(middle(clicks)), most: Math.round(Math.max(...clicks)) },
  }));
  // The browser may close before it answers.
  await Promise.race([tab.send("Browser.close").catch(() => {}), sleep(2000)]);
} finally {
  view.kill();
  browser.kill();
  await sleep(500);
  rmSync(profile, { recursive: true, force: true, maxRetries: 5 });
}
process.exit(0);
