// A headless Chromium for measurements, controlled by its DevTools protocol. Needs chromium and Node.js 20 with
// --experimental-websocket.

import { spawn } from "node:child_process";
import { mkdtempSync, readFileSync, rmSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";

export const sleep = (ms) => new Promise((done) => setTimeout(done, ms));

/** Waits until a condition has a value, and returns the value. */
export async function until(condition, seconds = 60) {
  for (let tries = 0; tries < 10 * seconds; tries += 1) {
    const found = await condition();
    if (found) return found;
    await sleep(100);
  }
  throw new Error(`timeout: ${condition}`);
}

/** Connects to DevTools: `send` sends a request, `events` has the received events, `evaluate` returns a value of the page. */
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
  const evaluate = async (expression) => {
    const { result } = await send("Runtime.evaluate", { expression, returnByValue: true, awaitPromise: true });
    return result.value;
  };
  return { send, events, evaluate };
}

/** Starts the tracing of a tab's frames and of its performance marks. */
export function startTrace(tab) {
  const includedCategories = ["blink.user_timing", "devtools.timeline", "disabled-by-default-devtools.timeline.frame", "disabled-by-default-devtools.timeline"];
  return tab.send("Tracing.start", { transferMode: "ReportEvents", traceConfig: { includedCategories } });
}

/** Ends the tracing of a tab and returns its events. */
export async function endTrace(tab) {
  await tab.send("Tracing.end");
  await until(() => tab.events.some(({ method }) => method === "Tracing.tracingComplete"));
  return tab.events.filter(({ method }) => method === "Tracing.dataCollected").flatMap(({ params }) => params.value);
}

/** Returns the rate of the drawn frames between two performance marks, and the longest time between two frames. */
export function pictures(trace, from, to) {
  const mark = (name) => trace.find((event) => event.name === name && event.cat?.includes("blink.user_timing"))?.ts;
  const drawn = trace.filter(({ name }) => name === "DrawFrame").map(({ ts }) => ts).toSorted((a, b) => a - b);
  const at = drawn.filter((ts) => mark(from) <= ts && ts < mark(to));
  const gaps = at.slice(1).map((ts, index) => (ts - at[index]) / 1000);
  return { per_s: +((1000 * gaps.length) / gaps.reduce((all, each) => all + each, 0)).toFixed(1), longest_ms: Math.round(Math.max(...gaps)) };
}

/** Starts a browser with one tab of this size, in pixels, and calls `use(tab, browser)`. The browser ends after it. */
export async function withChromium([width, height], use) {
  const profile = mkdtempSync(join(tmpdir(), "page-"));
  const browser = spawn("chromium", [
    "--headless=new", "--no-sandbox", "--disable-gpu", "--disable-renderer-backgrounding", "--disable-dev-shm-usage", "--no-first-run", "--disable-background-networking",
    "--remote-debugging-port=0", `--user-data-dir=${profile}`, `--window-size=${width},${height}`, "about:blank",
  ], { stdio: "ignore" });
  const hasEnded = new Promise((done) => browser.once("exit", done));
  try {
    const [port, path] = await until(() => {
      try {
        const lines = readFileSync(join(profile, "DevToolsActivePort"), "utf8").split("\n");
        return lines[1] ? lines : null;
      } catch {
        return null;
      }
    });
    const tabs = await until(() => fetch(`http://127.0.0.1:${port}/json`).then((response) => response.json(), () => null));
    const tab = await connect(tabs.find(({ type }) => type === "page").webSocketDebuggerUrl);
    await tab.send("Emulation.setDeviceMetricsOverride", { width, height, deviceScaleFactor: 1, mobile: false });
    const all = await connect(`ws://127.0.0.1:${port}${path}`);
    await use(tab, all);
    // The browser may close before it answers.
    await Promise.race([tab.send("Browser.close").catch(() => {}), sleep(2000)]);
  } finally {
    browser.kill();
    await hasEnded;
    // Its other processes may still write.
    rmSync(profile, { recursive: true, force: true, maxRetries: 5, retryDelay: 500 });
  }
}
