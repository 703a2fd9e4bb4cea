// Entry point of the page: connects the source of the run, the model, the panels and the keys.

import { offerEditor } from "./editor/editor.js";
import { choiceOf } from "./model/choice.js";
import { Model } from "./model/model.js";
import { stateOf } from "./model/state.js";
import { Beside } from "./panels/beside.js";
import { openBranch } from "./panels/branch.js";
import { Charts } from "./panels/charts.js";
import { Clock } from "./panels/clock.js";
import { Events } from "./panels/events.js";
import { Faults } from "./panels/faults.js";
import { Links } from "./panels/links.js";
import { Matrix } from "./panels/matrix.js";
import { Messages } from "./panels/messages.js";
import { drawMission, drawState } from "./panels/mission.js";
import { drawHash, offerLink, showChoice } from "./panels/playground.js";
import { Robots } from "./panels/robots.js";
import { Tasks } from "./panels/tasks.js";
import { Timeline } from "./panels/timeline.js";
import { obstacleMenu } from "./room/obstacle_menu.js";
import { Room } from "./room/room.js";
import { Tools } from "./room/tools.js";
import { Api } from "./source/api.js";
import { Embedded } from "./source/embedded.js";
import { Engine } from "./source/engine.js";
import { followLive, wasLive } from "./source/live.js";
import { LiveClock } from "./source/live_clock.js";
import { Log } from "./source/log.js";
import { Orders } from "./source/orders.js";
import { Player } from "./source/player.js";
import { showBar } from "./ui/bars.js";
import { Choices } from "./ui/choices.js";
import { attribute, byId, text } from "./ui/dom.js";
import { startKeys } from "./ui/keys.js";
import { Loop } from "./ui/loop.js";
import { closeMenu } from "./ui/menu.js";
import { notify } from "./ui/notices.js";
import { isShown, startTabs } from "./ui/tabs.js";
import { showTheme, startTheme } from "./ui/theme.js";
import { seconds } from "./ui/words.js";

/** Shows the reason why the page has no run. */
function showNoRun(reason) {
  document.body.dataset.state = "refused";
  text(byId("state"), "no run");
  text(byId("refused-why"), reason);
  byId("refused").hidden = false;
}

/**
 * Reads the part of the link after the #, such as `TOKEN&t=153`: `{token, start_s}`. A file has no token. `start_s` is
 * the time at which a log opens, simulated seconds; null: at its start.
 */
function readLink() {
  const words = location.hash.slice(1).split("&");
  const time = words.find((word) => word.startsWith("t="));
  const start_s = time ? Number(time.slice(2)) : Number.NaN;
  return { token: words[0] === time ? "" : words[0], start_s: Number.isFinite(start_s) ? start_s : null };
}

/** Starts the simulator inside this file with the run that the link names. */
async function play(engine) {
  try {
    const list = await engine.load();
    let choice = {};
    try {
      choice = await choiceOf(location.hash, engine.version);
    } finally {
      showChoice(list, choice, engine.version);
      offerEditor(engine, choice);
    }
    const run = await engine.open(choice);
    offerLink(engine, choice, engine.version);
    await show(engine, run);
  } catch (error) {
    // Another choice starts the page again.
    addEventListener("hashchange", () => location.reload());
    showNoRun(error.message);
  }
}

async function start() {
  // Also for a page without a run.
  showTheme();
  const engine = Engine.in(document);
  if (engine) {
    await play(engine);
    return;
  }
  const { token } = readLink();
  const file = Embedded.in(document);
  // Only a single file has its modules inside (launch/src/page/single_file.rs).
  if (!file && document.querySelector("script[type=importmap]")) {
    showNoRun("This file is damaged, its end is missing: copy or download it once more");
    return;
  }
  if (!file && !token) {
    // With another link the page starts again.
    addEventListener("hashchange", () => location.reload());
    showNoRun("This page needs the complete link that the command printed, including the part after the #.");
    return;
  }
  const source = file ?? new Api(token);
  try {
    await show(source, await source.run());
  } catch (error) {
    showNoRun(error.message);
  }
}

/** Shows a run. `source` answers the requests for its data: the server or the file (see source/). */
async function show(source, run) {
  const loop = new Loop();
  const changed = () => loop.request();
  const model = new Model(run, changed);
  const choices = new Choices(changed);
  const orders = new Orders(source, model, changed);
  const showError = (error) => showBar("warning", error.message);
  const log = model.isLive ? null : new Log(source, run, changed, showError);
  const player = log && new Player(log, model, changed);
  const clockwork = player ?? new LiveClock(model, orders);
  const seek = player && ((ms) => player.seekAfter(ms));

  text(byId("run-name"), run.run);
  byId("run-name").title = run.run;
  const origin = run.log?.branch ? `, branch of ${folderName({ folder: run.log.branch.run })} at ${seconds(run.log.branch.t_ms, 2)}` : "";
  const mode = model.isLive
    ? `live, seed ${run.seed}${run.folder && `, folder ${folderName(run)}`}`
    : `log, seed ${run.seed}${origin}: ${run.log.outcome ?? "unfinished"}`;
  text(byId("run-mode"), mode);
  byId("run-mode").title = run.folder ? `${mode}\nfolder: ${run.folder}` : mode;
  document.title = `${run.run} – alliance`;
  if (run.log?.warning) showBar("warning", run.log.warning);
  document.body.dataset.mode = run.mode;

  const room = new Room(byId("room-canvas"), model, choices);
  const beside = Beside.of(source, run, model, choices, changed);
  const clock = new Clock(model, clockwork);
  const robots = new Robots(model, choices, orders, changed);
  const links = new Links(model, choices, orders);
  const events = new Events(model, seek, changed);
  const load = log && ((rank) => source.corners(rank).then((corners) => model.addCorners(corners), showError));
  const charts = new Charts(model, choices, seek, load);
  const matrix = new Matrix(model, choices, changed);
  const timeline = player && new Timeline(model, player, events);
  const branch = player && (() => openBranch(model, player));
  if (branch) byId("branch").addEventListener("click", branch);
  const showTab = startTabs(changed);
  document.querySelector(".skip").addEventListener("click", (event) => {
    // The part of the address after the # is that of the run.
    event.preventDefault();
    if (!isShown("charts")) showTab("charts");
    byId("charts").focus();
  });
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
    beside?.refreshPalette();
    charts.refreshColors();
    changed();
  });
  for (const name of ["rays", "trails", "radio"]) byId(`show-${name}`).addEventListener("click", () => choices.toggle(name));
  byId("help").addEventListener("click", () => byId("help-window").showModal());

  // No message arrives from a frozen world, so a timer redraws the state.
  if (model.isLive) setInterval(changed, 1000);
  loop.before((wall_ms) => {
    const isPlaying = player?.advance(wall_ms);
    if (model.isBetween) loop.requestPicture();
    return isPlaying;
  });
  loop.add(0, () => {
    room.draw();
    tools.draw();
    beside?.draw();
    clock.draw();
    timeline?.draw();
    drawMission(model);
    drawHash(model);
    drawState(model, stateOf(model, clockwork), player?.isWaiting ?? false);
    for (const name of ["rays", "trails", "radio"]) attribute(byId(`show-${name}`), "aria-pressed", String(choices[name]));
  });
  loop.add(100, () => charts.draw());
  loop.add(100, () => matrix.draw());
  for (const panel of [robots, new Tasks(model, changed), events, new Messages(model), new Faults(model, orders)]) {
    loop.add(100, () => panel.draw());
  }
  // A large team has thousands of links: they are redrawn less often.
  loop.add(400, () => links.draw());
  new ResizeObserver(changed).observe(byId("room"));
  for (const id of ["chart-list", "matrix"]) new ResizeObserver(changed).observe(byId(id));

  window.alliance = Object.freeze({
    get view() {
      return model.view;
    },
    /** The description of the run, as from `/api/run`. */
    get run() {
      return run;
    },
    /** Returns the canvas position of a point of the room in CSS pixels. For tests and the console. */
    toScreen: (x_m, y_m) => room.toScreen(x_m, y_m),
  });
  startKeys(shortcuts({ model, choices, orders, player, clockwork, clock, timeline, tools, robots, select, branch }));
  changed();

  const { token, start_s } = readLink();
  addEventListener("hashchange", () => {
    const link = readLink();
    // A link to another moment needs no reload. A link to another run in the same tab changes only the hash, too.
    if (player && link.token === token && link.start_s !== null) seek(1000 * link.start_s);
    else location.reload();
  });
  if (model.isLive) {
    followLive(source, model);
    return;
  }
  source.accompany();
  if (wasLive(run)) player.seek(Infinity);
  else if (start_s !== null) seek(1000 * start_s);
  try {
    const [events, samples] = await Promise.all([source.events(), source.overview()]);
    model.addEvents(events);
    if (run.log.outcome && run.log.outcome !== "running") model.addEnd(run.log.duration_ms, run.log.outcome);
    model.addSamples(samples);
  } catch (error) {
    showError(error);
  }
}

/** Returns the name of the run's folder, which reports and later pages of the run have as the run's name. */
function folderName({ folder }) {
  return folder.split("/").at(-1);
}

/** Returns the keyboard shortcuts. Fault and obstacle keys exist only for a live run. */
function shortcuts({ model, choices, orders, player, clockwork, clock, timeline, tools, robots, select, branch }) {
  const key = (keys, shown, action, run) => ({ keys, shown, action, run });
  const onSelected = (act) => () => {
    if (choices.selected !== null) act(choices.selected);
    else notify("refused", "Select a robot first: click on it, or press its number");
  };
  const common = [
    key([" "], "Space", player ? "play or pause" : "pause or resume", () => clockwork.toggle()),
    key(["."], ".", "one step", () => clockwork.step(1)),
    key([">"], ">", "ten steps", () => clockwork.step(10)),
    key(["+", "="], "+", "twice as fast", () => clock.scale(2)),
    key(["-"], "-", "half as fast", () => clock.scale(0.5)),
    key(["m"], "m", "as fast as possible", () => clockwork.setSpeed(null)),
    key([..."123456789"], "1 … 9", "select a robot", ({ key: digit }) => digit <= model.names.length && select(digit - 1)),
    key(["r"], "r", "sensor rays of the selected robot, or of all robots", () => choices.toggle("rays")),
    key(["t"], "t", "trails of the last minute", () => choices.toggle("trails")),
    key(["l"], "l", "radio links", () => choices.toggle("radio")),
    key(["0"], "0", "show the whole room", () => tools.magnify(0)),
    key(["f"], "f", "follow the selected robot, zoomed in", () => choices.selected !== null && tools.follow()),
    key(["d"], "d", "dark or light theme", () => byId("theme").click()),
    key(["?"], "?", "this list", () => byId("help").click()),
    key(["Escape"], "Esc", "leave the field, put the tool away, clear the selection", () => {
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
      onSelected((rank) => robots.kill(rank)),
    ),
    key(
      ["s"],
      "s",
      "pause the selected robot's process, or continue it",
      onSelected((rank) => robots.pause(rank)),
    ),
    key(
      ["b"],
      "b",
      "restart the selected robot, without its memory",
      onSelected((rank) => robots.restart(rank)),
    ),
    key(["u"], "u", "undo the latest order of this page", () => orders.undo()),
  ];
  const log = [
    key(["ArrowRight"], "→", "one second forward; with Shift ten", ({ shiftKey }) => player.move(shiftKey ? 10_000 : 1000)),
    key(["ArrowLeft"], "←", "one second back; with Shift ten", ({ shiftKey }) => player.move(shiftKey ? -10_000 : -1000)),
    key(["Home"], "Home", "to the start", () => player.seek(0)),
    key(["End"], "End", "to the end", () => player.seek(Infinity)),
    key(["n"], "n", "next listed event", () => timeline.jump(1)),
    key(["p"], "p", "previous listed event", () => timeline.jump(-1)),
    key(["b"], "b", "branch from here: the command that repeats the run up to this time and goes on", branch),
  ];
  if (!model.isLive) return [...common, ...log];
  const taken = [...common, ...live].flatMap(({ keys }) => keys);
  const faultKeys = tools.faultKeys(taken).map(({ letter, about, tool }) => key([letter], letter, about, () => tools.take(tool)));
  return [...common, ...live, ...faultKeys];
}

start();
