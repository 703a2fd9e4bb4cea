// Measures the page of a finished run with Chromium's tracing: frames per second at real time and at four times that,
// and the time from a click to the next frame. Needs chromium, Node.js 20 and a run folder:
//   node --experimental-websocket tests/benches/page.mjs target/release/alliance FOLDER [PICTURE.png]
import { spawn } from "node:child_process";
import { writeFileSync } from "node:fs";
import { endTrace, pictures, sleep, startTrace, until, withChromium } from "./chromium.mjs";

const [program, folder, picture] = process.argv.slice(2);
const PLAY_MS = 10_000;
const FAST = 4; // times real time
const [WIDTH, HEIGHT] = [1600, 1000];
// The elements to click, in order. Missing ones are skipped.
const CLICKS = [
  "#tab-events", "#tab-messages", "#tab-links", "#tab-faults", "#tab-tasks", "#robot-cards [data-action=select]", "#matrix-canvas",
  "#follow", "#show-radio", "#show-rays", "#zoom-in", "#zoom-all",
];

const middle = (numbers) => numbers.toSorted((a, b) => a - b)[Math.floor(numbers.length / 2)];

const view = spawn(program, ["watch", folder], { stdio: ["ignore", "ignore", "pipe"] });
let output = "";
view.stderr.on("data", (data) => (output += data));

/** Measures the page in a tab. */
async function measure(tab) {
  const { evaluate } = tab;
  const link = await until(() => output.match(/http:\S+#\S+/)?.[0]);
  await tab.send("Page.navigate", { url: link });
  await until(() => evaluate("!!window.alliance?.view"));
  const elements = await evaluate("document.querySelectorAll('*').length");

  await startTrace(tab);
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
  const trace = await endTrace(tab);
  if (process.env.TRACE) writeFileSync(process.env.TRACE, JSON.stringify(trace));
  if (picture) {
    const { data } = await tab.send("Page.captureScreenshot", { format: "png" });
    writeFileSync(picture, Buffer.from(data, "base64"));
  }

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
    elements, elements_in_the_end: tabOpen, pictures: pictures(trace, "plays", "faster"), [`pictures_at_${FAST}x`]: pictures(trace, "faster", "clicks"),
    clicks: clicked.length, click_ms: { median: Math.round(middle(clicks)), most: Math.round(Math.max(...clicks)) },
  }));
}

try {
  await withChromium([WIDTH, HEIGHT], measure);
} finally {
  view.kill();
}
process.exit(0);
