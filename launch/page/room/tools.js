// What the pointer does in the room: look at things, draw an obstacle, break what the mission declares, put a robot elsewhere.

import { attribute, byId, text } from "../ui/dom.js";
import { FaultTools } from "./fault_tools.js";
import { showPoint } from "./room.js";

/** Rectangles snap to this grid, and smaller ones are a mere click, m. */
const GRID_M = 0.05;

const HINTS = {
  look: "",
  obstacle: "Drag:",
  move: "Click its new place.",
};

const snap = (m) => Number((Math.round(m / GRID_M) * GRID_M).toFixed(2));

export class Tools {
  #canvas;
  #room;
  #model;
  #choices;
  #orders;
  #faults;
  #look;
  // Where the rectangle that is being drawn began, m.
  #start = null;
  // Whether the click that is about to come only ends a drag.
  #hasDrawn = false;

  /** `look(found, event)` is called with what a click has found (see Room.pick), or null. */
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
    // Not on pointerup: the browser would take that for a click beside the menu that opens, and close it.
    canvas.addEventListener("click", (event) => this.#click(event));
    canvas.addEventListener("pointercancel", () => this.#forget());
    canvas.addEventListener("pointerleave", () => showPoint(byId("pointer"), null));
    for (const button of document.querySelectorAll("[data-tool-button]")) {
      button.addEventListener("click", () => this.take(button.dataset.toolButton));
    }
  }

  /** Takes up a tool, or puts it down if it is in hand. */
  take(tool) {
    const wanted = this.#choices.tool === tool || !this.#model.isOpen ? "look" : tool;
    this.#forget();
    this.#faults.take(wanted);
    this.#choices.set({ tool: wanted });
    this.draw();
  }

  /** What keys take up tools of the mission: see FaultTools.keys. */
  faultKeys(taken) {
    return this.#faults.keys(taken);
  }

  /** Brings buttons and hints up to date. */
  draw() {
    const { tool } = this.#choices;
    if (tool !== "look" && !this.#model.isOpen) this.take("look");
    for (const button of document.querySelectorAll("[data-tool-button]")) {
      attribute(button, "aria-pressed", String(button.dataset.toolButton === tool));
    }
    this.#canvas.dataset.tool = tool;
    byId("tool-options").hidden = tool === "look";
    byId("penetrability").hidden = tool !== "obstacle";
    text(byId("tool-hint"), HINTS[tool] ?? this.#faults.hint(tool));
  }

  #forget() {
    this.#start = null;
    this.#room.draft = null;
  }

  #press(event) {
    this.#hasDrawn = false;
    if (event.button !== 0 || this.#choices.tool !== "obstacle") return;
    this.#start = this.#room.pointUnder(event);
    this.#canvas.setPointerCapture(event.pointerId);
  }

  #drag(event) {
    const point = this.#room.pointUnder(event);
    showPoint(byId("pointer"), point);
    if (this.#start) {
      this.#room.draft = this.#rectangle(point);
      this.#choices.set({});
    } else if (this.#choices.tool === "look") {
      this.#canvas.style.cursor = this.#room.pick(event) ? "pointer" : "";
    } else {
      this.#canvas.style.cursor = "crosshair";
    }
  }

  #rectangle(point) {
    const [left, right] = [this.#start.x, point.x].map(snap).sort((a, b) => a - b);
    const [bottom, top] = [this.#start.y, point.y].map(snap).sort((a, b) => a - b);
    const size = (low, high) => Number((high - low).toFixed(2));
    const penetrability = Number(byId("penetrability").value);
    return { x_m: left, y_m: bottom, width_m: size(left, right), height_m: size(bottom, top), penetrability };
  }

  #release(event) {
    if (!this.#start) return;
    const draft = this.#rectangle(this.#room.pointUnder(event));
    this.#forget();
    this.#choices.set({});
    if (draft.width_m <= 0 || draft.height_m <= 0) return;
    this.#hasDrawn = true;
    this.#orders.arm({ obstacle: draft }, lasts());
  }

  #click(event) {
    if (this.#hasDrawn) return;
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

/** For how long an order shall hold, as the field beside the tools says: simulated seconds, or null for until it is undone. */
export function lasts() {
  const value = byId("for-s").valueAsNumber;
  return value > 0 ? value : null;
}
