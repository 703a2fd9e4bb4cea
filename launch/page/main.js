// Wires the page: where the run comes from, what shows it, what the keys do.

import { Model } from "./model/model.js";
import { Charts } from "./panels/charts.js";
import { Clock } from "./panels/clock.js";
import { Events } from "./panels/events.js";
import { Faults } from "./panels/faults.js";
import { Links } from "./panels/links.js";
import { Matrix } from "./panels/matrix.js";
import { Messages } from "./panels/messages.js";
import { drawMission, drawState } from "./panels/mission.js";
import { Robots } from "./panels/robots.js";
import { Tasks } from "./panels/tasks.js";
import { Timeline } from "./panels/timeline.js";
import { obstacleMenu } from "./room/obstacle_menu.js";
import { Room } from "./room/room.js";
import { Tools } from "./room/tools.js";
import { Api } from "./source/api.js";
import { followLive, wasLive } from "./source/live.js";
import { LiveClock } from "./source/live_clock.js";
import { Log } from "./source/log.js";
import { Orders } from "./source/orders.js";
import { Player } from "./source/player.js";
import { Choices } from "./ui/choices.js";
import { attribute, byId, text } from "./ui/dom.js";
import { startKeys } from "./ui/keys.js";
import { Loop } from "./ui/loop.js";
import { closeMenu } from "./ui/menu.js";
import { notify } from "./ui/notices.js";
import { isShown, startTabs } from "./ui/tabs.js";
import { startTheme } from "./ui/theme.js";

/** Says why there is nothing to see. */
function refuse(why) {
  document.body.dataset.state = "refused";
  text(byId("state"), "no run");
  text(byId("refused-why"), why);
  byId("refused").hidden = false;
}

async function start() {
  // Another link in the same tab is another run.
  addEventListener("hashchange", () => location.reload());
  const token = location.hash.slice(1);
  if (!token) {
    refuse(
      "This page shows a run to whoever has its link. Open the whole link that the command has printed, with what follows the #.",
    );
    return;
  }
  const api = new Api(token);
  try {
    const run = await api.get("/api/run");
    await show(api, run);
  } catch (error) {
    refuse(error.message);
  }
}

async function show(api, run) {
  const loop = new Loop();
  const changed = () => loop.request();
  const model = new Model(run, changed);
  const choices = new Choices(changed);
  const orders = new Orders(api, model, changed);
  const stop = (error) => notify("refused", error.message);
  const log = model.isLive ? null : new Log(api, run, changed, stop);
  const player = log && new Player(log, model, changed);
  const clockwork = player ?? new LiveClock(model, orders);
  const seek = player && ((ms) => player.seekAfter(ms));

  text(byId("run-name"), run.run);
  byId("run-name").title = run.run;
  text(byId("run-mode"), model.isLive ? `live, seed ${run.seed}` : `log, seed ${run.seed}: ${run.log.outcome ?? "unfinished"}`);
  document.title = `${run.run} – alliance`;
  if (run.log?.warning) {
    text(byId("warning"), run.log.warning);
    byId("warning").hidden = false;
  }
  document.body.dataset.mode = run.mode;

  const room = new Room(byId("room-canvas"), model, choices);
  const clock = new Clock(model, clockwork);
  const robots = new Robots(model, choices, orders, changed);
  const links = new Links(model, choices, orders);
  const events = new Events(model, seek, changed);
  const load = log && ((rank) => log.bends(rank).then((bends) => model.bend(bends), stop));
  const charts = new Charts(model, choices, seek, load);
  const matrix = new Matrix(model, choices, changed);
  const timeline = player && new Timeline(model, player, events);
  const showTab = startTabs(changed);
  const select = (rank) => {
    choices.set({ selected: rank });
    if (rank === null) return;
    if (!isShown("robots")) showTab("robots");
    robots.draw();
    robots.reveal(rank);
  };
  const tools = new Tools(byId("room-canvas"), room, model, choices, orders, (found, event) => {
    const at = { x: event.clientX, y: event.clientY };
    if (found?.obstacle) obstacleMenu(found.obstacle, room.faultBehind(found.obstacle), orders, model.isOpen, at);
    else if (found?.link) links.open(...found.link, at);
    else select(found?.robot ?? null);
  });
  startTheme(byId("theme"), () => {
    room.refreshPalette();
    charts.refreshColors();
    changed();
  });
  for (const name of ["rays", "trails", "radio"]) byId(`show-${name}`).addEventListener("click", () => choices.toggle(name));
  byId("help").addEventListener("click", () => byId("help-window").showModal());

  const state = () => {
    if (!model.view) return "connecting";
    if (model.ended || (player?.paused && player.atEnd)) return "ended";
    if (model.isFrozen) return "frozen";
    if (clockwork.paused) return "paused";
    if (model.isOpen && model.view.clock.waits_for) return "standing";
    const isEverybodyHere = model.view.tick > 0 || model.view.robots.every(({ state: each }) => each === "present" || each === "absent");
    return isEverybodyHere ? "running" : "waiting";
  };
  // A world that says nothing changes nothing here, but how long it has done so.
  if (model.isLive) setInterval(changed, 1000);
  loop.before((wall_ms) => player?.advance(wall_ms));
  loop.add(0, () => {
    room.draw();
    tools.draw();
    clock.draw();
    timeline?.draw();
    drawMission(model);
    drawState(model, state());
    for (const name of ["rays", "trails", "radio"]) attribute(byId(`show-${name}`), "aria-pressed", String(choices[name]));
  });
  loop.add(100, () => charts.draw());
  loop.add(100, () => matrix.draw());
  for (const panel of [robots, new Tasks(model, changed), events, new Messages(model), new Faults(model, orders)]) {
    loop.add(100, () => panel.draw());
  }
  // Of a large team there are thousands.
  loop.add(400, () => links.draw());
  new ResizeObserver(changed).observe(byId("room"));
  new ResizeObserver(changed).observe(byId("chart-list"));

  window.alliance = Object.freeze({
    /** The newest view. */
    get view() {
      return model.view;
    },
    /** Answer of /api/run. */
    get run() {
      return run;
    },
    /** Where a point of the room is: CSS pixels from the upper left corner of the canvas. For tests and consoles. */
    toScreen: (x_m, y_m) => room.toScreen(x_m, y_m),
  });
  startKeys(shortcuts({ model, choices, orders, player, clockwork, clock, timeline, tools, robots, select }));
  changed();

  if (model.isLive) {
    followLive(api, model);
  } else {
    api.accompany();
    if (wasLive(run)) player.seek(Infinity);
    const [all, whole] = await Promise.all([api.get("/api/events"), log.overview()]);
    model.addEvents(all);
    model.remember(whole);
  }
}

/** What the keys do; in a log nothing can be broken. */
function shortcuts({ model, choices, orders, player, clockwork, clock, timeline, tools, robots, select }) {
  const key = (keys, shown, does, run) => ({ keys, shown, does, run });
  const chosen = (act) => () => {
    if (choices.selected !== null) act(choices.selected);
    else notify("refused", "select a robot first: click on it, or press its number");
  };
  const both = [
    key([" "], "Space", player ? "play, pause" : "pause, go on", () => clockwork.toggle()),
    key(["."], ".", "one step", () => clockwork.step(1)),
    key([">"], ">", "ten steps", () => clockwork.step(10)),
    key(["+", "="], "+", "twice as fast", () => clock.scale(2)),
    key(["-"], "-", "half as fast", () => clock.scale(0.5)),
    key(["m"], "m", "as fast as possible", () => clockwork.setSpeed(null)),
    key([..."123456789"], "1 … 9", "select a robot", ({ key: digit }) => digit <= model.names.length && select(digit - 1)),
    key(["r"], "r", "sensor rays, of the selected robot or of all", () => choices.toggle("rays")),
    key(["t"], "t", "trails of the last minute", () => choices.toggle("trails")),
    key(["l"], "l", "radio links", () => choices.toggle("radio")),
    key(["0"], "0", "see all of the room", () => tools.magnify(0)),
    key(["f"], "f", "keep the selected robot in the middle, larger", () => choices.selected !== null && tools.follow()),
    key(["d"], "d", "dark or light", () => byId("theme").click()),
    key(["?"], "?", "this list", () => byId("help").click()),
    key(["Escape"], "Esc", "leave the field, put the tool down, select nothing", () => {
      closeMenu();
      if (document.activeElement.matches("input, select")) document.activeElement.blur();
      else if (choices.tool !== "look") tools.take("look");
      else select(null);
    }),
  ];
  const live = [
    key(["o"], "o", "draw an obstacle", () => tools.take("obstacle")),
    key(
      ["k"],
      "k",
      "kill the selected robot",
      chosen((rank) => robots.kill(rank)),
    ),
    key(
      ["s"],
      "s",
      "stop the selected robot, or let it go on",
      chosen((rank) => robots.pause(rank)),
    ),
    key(
      ["b"],
      "b",
      "bring the selected robot back in a new life: restart",
      chosen((rank) => robots.restart(rank)),
    ),
    key(["u"], "u", "undo the latest order of this page", () => orders.undo()),
  ];
  const log = [
    key(["ArrowRight"], "→", "a second on; with Shift ten", ({ shiftKey }) => player.move(shiftKey ? 10_000 : 1000)),
    key(["ArrowLeft"], "←", "a second back; with Shift ten", ({ shiftKey }) => player.move(shiftKey ? -10_000 : -1000)),
    key(["Home"], "Home", "to the start", () => player.seek(0)),
    key(["End"], "End", "to the end", () => player.seek(Infinity)),
    key(["n"], "n", "next event of those listed", () => timeline.jump(1)),
    key(["p"], "p", "previous event of those listed", () => timeline.jump(-1)),
  ];
  if (!model.isLive) return [...both, ...log];
  const taken = [...both, ...live].flatMap(({ keys }) => keys);
  const own = tools.faultKeys(taken).map(({ letter, about, tool }) => key([letter], letter, about, () => tools.take(tool)));
  return [...both, ...live, ...own];
}

start();
