// The tools in the room, for a pointer and for keys: look, draw an obstacle, arm the mission's faults, move a robot.

import { markInWords } from "../model/marks.js";
import { attribute, byId, text } from "../ui/dom.js";
import { FaultTools } from "./fault_tools.js";
import { ARROWS } from "./geometry.js";
import { showPoint } from "./room.js";

/** The grid of drawn rectangles, m. A smaller rectangle counts as a click. */
const GRID_M = 0.05;

const HINTS = {
  look: "",
  obstacle: "Drag in the room:",
  move: "Click the robot's new place.",
};

/** The magnification per notch of the wheel and per press of a button. */
const NOTCH = 1.25;
const PRESS = 1.6;
/** A shorter drag counts as a click, px. */
const MAX_CLICK_PX = 4;

const snap = (m) => Number((Math.round(m / GRID_M) * GRID_M).toFixed(2));

export class Tools {
  #canvas;
  #room;
  #model;
  #choices;
  #orders;
  #faults;
  #look;
  // The start of the rectangle that is being drawn, m.
  #start = null;
  // The pointer position at the press or the last pan, CSS pixels, and whether the pointer has moved.
  #pan = null;
  // The next click only ends a drag.
  #ignoresClick = false;
  // The point at which keys acted last, m.
  #last = null;

  /** Calls `look(found, event)` with the object that was clicked (see Room.pick), or null. */
  constructor(canvas, room, model, choices, orders, look) {
    this.#canvas = canvas;
    this.#room = room;
    this.#model = model;
    this.#choices = choices;
    this.#orders = orders;
    this.#faults = new FaultTools(model.run.mission.faults, orders);
    this.#look = look;
    canvas.addEventListener("pointerdown", (event) => this.#press(event));
    canvas.addEventListener("pointermove", (event) => this.#drag(event));
    canvas.addEventListener("pointerup", (event) => this.#release(event));
    // Not on pointerup: the browser would count it as a click outside the new menu and close that.
    canvas.addEventListener("click", (event) => this.#click(event));
    canvas.addEventListener(
      "wheel",
      (event) => {
        event.preventDefault();
        this.magnify(event.deltaY < 0 ? NOTCH : 1 / NOTCH, room.pointUnder(event));
      },
      { passive: false },
    );
    canvas.addEventListener("dblclick", () => this.magnify(0));
    byId("zoom-in").addEventListener("click", () => this.magnify(PRESS));
    byId("zoom-out").addEventListener("click", () => this.magnify(1 / PRESS));
    byId("zoom-all").addEventListener("click", () => this.magnify(0));
    byId("follow").addEventListener("click", () => this.follow());
    canvas.addEventListener("pointercancel", () => this.#cancel());
    canvas.addEventListener("keydown", (event) => this.#key(event));
    canvas.addEventListener("focus", () => canvas.matches(":focus-visible") && this.#point(this.#last ?? { ...room.lens.center }));
    canvas.addEventListener("blur", () => this.#point(null));
    canvas.addEventListener("pointerleave", () => {
      showPoint(byId("pointer"), null);
      this.#hover(null);
    });
    for (const button of document.querySelectorAll("[data-tool-button]")) {
      button.addEventListener("click", () => this.take(button.dataset.toolButton));
    }
  }

  /** Magnifies the room around a point; by default around its middle or the selected robot. 0 shows the whole room. */
  magnify(factor, point = null) {
    const { lens, follows } = this.#room;
    const selected = this.#model.view?.robots[this.#choices.selected]?.pose.position;
    const middle = selected && (follows || lens.zoom === 1) ? { x: selected[0], y: selected[1] } : lens.center;
    lens.magnify(factor, point ?? middle);
    if (lens.zoom === 1) this.#room.follows = false;
    this.#choices.set({});
  }

  /** Toggles whether the selected robot stays in the middle. */
  follow() {
    this.#room.follows = !this.#room.follows;
    if (this.#room.follows && this.#room.lens.zoom === 1) this.magnify(4);
    else this.#choices.set({});
  }

  /** Selects a tool, or deselects it if it is selected. */
  take(tool) {
    const wanted = this.#choices.tool === tool || !this.#model.isOpen ? "look" : tool;
    this.#cancel();
    this.#faults.take(wanted);
    this.#choices.set({ tool: wanted });
    this.draw();
  }

  /** Assigns keys to the mission's faults: see FaultTools.keys. */
  faultKeys(taken) {
    return this.#faults.keys(taken);
  }

  /** Updates buttons and hints. */
  draw() {
    const { tool } = this.#choices;
    if (tool !== "look" && !this.#model.isOpen) this.take("look");
    for (const button of document.querySelectorAll("[data-tool-button]")) {
      attribute(button, "aria-pressed", String(button.dataset.toolButton === tool));
      button.disabled = !this.#model.isOpen;
    }
    const { lens, follows } = this.#room;
    attribute(byId("follow"), "aria-pressed", String(follows));
    byId("follow").disabled = this.#choices.selected === null && !follows;
    byId("zoom-all").disabled = byId("zoom-out").disabled = lens.zoom === 1;
    attribute(this.#canvas, "data-zoom", lens.zoom.toFixed(2));
    byId("tool-options").hidden = tool === "look";
    byId("penetrability").hidden = tool !== "obstacle";
    const hint = HINTS[tool] ?? this.#faults.hint(tool);
    text(byId("tool-hint"), hint);
    // The next key acts in the room.
    if (hint && this.#canvas.dataset.tool !== tool) this.#canvas.focus({ preventScroll: true });
    this.#canvas.dataset.tool = tool;
  }

  #cancel() {
    this.#start = null;
    this.#pan = null;
    this.#room.draft = null;
  }

  /** Shows the point at which keys act, m, or hides it. */
  #point(at) {
    this.#last = this.#room.pointer ?? this.#last;
    this.#room.pointer = at;
    showPoint(byId("pointer"), at);
    this.#hover(null);
    this.#choices.set({});
  }

  /** Arrow keys move the point at which keys act. Enter clicks there; of an obstacle it marks two corners. */
  #key(event) {
    const arrow = ARROWS[event.key];
    const isOther = (!arrow && event.key !== "Enter") || event.ctrlKey || event.metaKey || event.altKey;
    if (isOther || !this.#room.pointer) return;
    event.preventDefault();
    event.stopPropagation();
    const at = arrow ? this.#room.movePointer(arrow, event.shiftKey) : this.#room.underKeys();
    this.#ignoresClick = false;
    if (arrow) this.#drag(at);
    else if (this.#start) this.#release(at);
    else if (this.#choices.tool === "obstacle") this.#start = this.#room.pointUnder(at);
    else this.#click(at);
    this.#choices.set({});
  }

  #press(event) {
    this.#room.pointer = null;
    this.#ignoresClick = false;
    if (event.button !== 0) return;
    if (this.#choices.tool === "look" && this.#room.lens.zoom > 1) {
      this.#pan = { x: event.clientX, y: event.clientY, hasMoved: false };
      this.#canvas.setPointerCapture(event.pointerId);
    }
    if (this.#choices.tool !== "obstacle") return;
    this.#start = this.#room.pointUnder(event);
    this.#canvas.setPointerCapture(event.pointerId);
  }

  #drag(event) {
    const point = this.#room.pointUnder(event);
    showPoint(byId("pointer"), point);
    const mark = this.#room.markUnder(event);
    attribute(this.#canvas, "title", mark && markInWords(mark));
    if (this.#pan) {
      this.#panTo(event);
    } else if (this.#start) {
      this.#room.draft = this.#rectangle(point);
      this.#choices.set({});
    } else if (this.#choices.tool === "look") {
      const found = this.#room.pick(event);
      this.#canvas.style.cursor = found ? "pointer" : "";
      this.#hover(found?.robot ?? null);
    } else {
      this.#canvas.style.cursor = "crosshair";
    }
  }

  /** Shows the label of the robot under the pointer. */
  #hover(rank) {
    if (rank === this.#room.hovered) return;
    this.#room.hovered = rank;
    this.#choices.set({});
  }

  /** Pans the picture with the pointer. */
  #panTo(event) {
    const { lens } = this.#room;
    const [dx, dy] = [event.clientX - this.#pan.x, event.clientY - this.#pan.y];
    if (!this.#pan.hasMoved && Math.hypot(dx, dy) < MAX_CLICK_PX) return;
    const [from, to] = [{ clientX: this.#pan.x, clientY: this.#pan.y }, event].map((each) => this.#room.pointUnder(each));
    this.#pan = { x: event.clientX, y: event.clientY, hasMoved: true };
    this.#room.follows = false;
    lens.lookAt({ x: lens.center.x + from.x - to.x, y: lens.center.y + from.y - to.y });
    this.#choices.set({});
  }

  #rectangle(point) {
    const [left, right] = [this.#start.x, point.x].map(snap).sort((a, b) => a - b);
    const [bottom, top] = [this.#start.y, point.y].map(snap).sort((a, b) => a - b);
    const size = (low, high) => Number((high - low).toFixed(2));
    const penetrability = Number(byId("penetrability").value);
    return { x_m: left, y_m: bottom, width_m: size(left, right), height_m: size(bottom, top), penetrability };
  }

  #release(event) {
    this.#ignoresClick = this.#pan?.hasMoved ?? false;
    this.#pan = null;
    if (!this.#start) return;
    const draft = this.#rectangle(this.#room.pointUnder(event));
    this.#cancel();
    this.#choices.set({});
    if (draft.width_m <= 0 || draft.height_m <= 0) return;
    this.#ignoresClick = true;
    this.#orders.arm({ obstacle: draft }, chosenDuration());
  }

  #click(event) {
    if (this.#ignoresClick) return;
    const { x, y } = this.#room.pointUnder(event);
    const point = { x: snap(x), y: snap(y) };
    const { tool, selected } = this.#choices;
    if (this.#faults.click(tool, point, this.#room.itemUnder(event))) return;
    if (tool === "move" && selected !== null) {
      this.#orders.arm({ "move-robot": { robot: this.#model.names[selected], x_m: point.x, y_m: point.y } });
      this.take("look");
    } else {
      this.#look(this.#room.pick(event), event);
    }
  }
}

/** Returns the duration of an order from the toolbar's field: simulated seconds, or null for an unlimited one. */
export function chosenDuration() {
  const value = byId("for-s").valueAsNumber;
  return value > 0 ? value : null;
}
