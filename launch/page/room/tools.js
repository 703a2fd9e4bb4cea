// What the pointer does in the room: look at things, draw an obstacle, break what the mission declares, put a robot elsewhere.

import { attribute, byId, text } from "../ui/dom.js";
import { FaultTools } from "./fault_tools.js";
import { showPoint } from "./room.js";

/** Rectangles snap to this grid, and smaller ones are a mere click, m. */
const GRID_M = 0.05;

const HINTS = {
  look: "",
  obstacle: "Drag in the room to draw it.",
  move: "Click its new place.",
};

/** Magnified by so much per notch of the wheel, and press of a button. */
const NOTCH = 1.25;
const PRESS = 1.6;
/** A drag of fewer pixels is a click. */
const STILL_PX = 4;

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
  // Where the pointer was when it was pressed or last moved the picture, CSS pixels, and whether it has.
  #pan = null;
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
    canvas.addEventListener("pointercancel", () => this.#forget());
    canvas.addEventListener("pointerleave", () => showPoint(byId("pointer"), null));
    for (const button of document.querySelectorAll("[data-tool-button]")) {
      button.addEventListener("click", () => this.take(button.dataset.toolButton));
    }
  }

  /** Magnifies the room about a point of it; by default about its middle, or the robot that is selected. 0: all of it is seen. */
  magnify(factor, point = null) {
    const { lens, follows } = this.#room;
    const selected = this.#model.view?.robots[this.#choices.selected]?.pose.position;
    const middle = selected && (follows || lens.zoom === 1) ? { x: selected[0], y: selected[1] } : lens.center;
    lens.magnify(factor, point ?? middle);
    if (lens.zoom === 1) this.#room.follows = false;
    this.#choices.set({});
  }

  /** Keeps the selected robot in the middle, or no longer. */
  follow() {
    this.#room.follows = !this.#room.follows;
    if (this.#room.follows && this.#room.lens.zoom === 1) this.magnify(4);
    else this.#choices.set({});
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
      button.disabled = !this.#model.isOpen;
    }
    const { lens, follows } = this.#room;
    attribute(byId("follow"), "aria-pressed", String(follows));
    byId("follow").disabled = this.#choices.selected === null && !follows;
    byId("zoom-all").disabled = byId("zoom-out").disabled = lens.zoom === 1;
    attribute(this.#canvas, "data-zoom", lens.zoom.toFixed(2));
    this.#canvas.dataset.tool = tool;
    byId("tool-options").hidden = tool === "look";
    byId("penetrability").hidden = tool !== "obstacle";
    text(byId("tool-hint"), HINTS[tool] ?? this.#faults.hint(tool));
  }

  #forget() {
    this.#start = null;
    this.#pan = null;
    this.#room.draft = null;
  }

  #press(event) {
    this.#hasDrawn = false;
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
    if (this.#pan) {
      this.#panTo(event);
    } else if (this.#start) {
      this.#room.draft = this.#rectangle(point);
      this.#choices.set({});
    } else if (this.#choices.tool === "look") {
      this.#canvas.style.cursor = this.#room.pick(event) ? "pointer" : "";
    } else {
      this.#canvas.style.cursor = "crosshair";
    }
  }

  /** Moves the picture along with the pointer. */
  #panTo(event) {
    const { lens } = this.#room;
    const [dx, dy] = [event.clientX - this.#pan.x, event.clientY - this.#pan.y];
    if (!this.#pan.hasMoved && Math.hypot(dx, dy) < STILL_PX) return;
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
    this.#hasDrawn = this.#pan?.hasMoved ?? false;
    this.#pan = null;
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
