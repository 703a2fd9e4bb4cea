// The drawing of an edited scenario: paints the start of its run, and turns the pointer and keys into changes.

import { dragged, gridOf, idOf, isRectangle, neighbor, rectangleBetween, shifted, snap } from "../model/draft.js";
import { ARROWS, Lens, Projection, isWithin, lowerLeft } from "../room/geometry.js";
import { LEAST_PX, paintBody } from "../room/body.js";
import * as paint from "../room/paint.js";
import { signs } from "../model/signs.js";
import { attribute } from "../ui/dom.js";
import { meters } from "../ui/words.js";

const MARGIN_PX = 12;
/** The maximum distance of the pointer from an item or a handle, px. */
const NEAR_PX = 8;
/** A shorter drag counts as a click, px. */
const MAX_CLICK_PX = 4;
/** The size of a handle, px, and the distance of a heading's handle from its robot's edge. */
const HANDLE_PX = 9;
const NOSE_PX = 22;
/** The steps of the arrow keys, in units of the grid. */
const STEP = 2;
const LONG_STEP = 20;

export class Drawing {
  #canvas;
  #actions;
  #palette = null;
  #projection = null;
  #shown = null;
  #selected = null;
  #tool = null;
  // The place of the tool, m.
  #cursor = null;
  // `{item, handle, from, to, hasMoved, at}`: a drag of an item; without an item, of a rectangle.
  #drag = null;

  /** `actions`: `select(id)`, `change(change)`, `move(dx, dy)` and `remove()` of the selected item, and `drop()` of the tool. */
  constructor(canvas, actions) {
    this.#canvas = canvas;
    this.#actions = actions;
    canvas.addEventListener("pointerdown", (event) => this.#press(event));
    canvas.addEventListener("pointermove", (event) => this.#move(event));
    canvas.addEventListener("pointerup", (event) => this.#release(event));
    canvas.addEventListener("pointercancel", () => this.#cancel());
    canvas.addEventListener("keydown", (event) => this.#key(event));
    for (const name of ["focus", "blur"]) canvas.addEventListener(name, () => this.paint());
    new ResizeObserver(() => this.paint()).observe(canvas.parentElement);
  }

  /** Shows a drawing with the id of the selected item and the tool: `{kind, variant}` of new items, or null. */
  show(drawing, selected, tool) {
    const { scenario } = drawing.run;
    if (tool && !this.#tool) this.#cursor = this.#middle(scenario.room);
    this.#shown = drawing;
    this.#selected = selected;
    this.#tool = tool;
    this.paint();
  }

  /** Reads the theme's colors again. */
  refreshPalette() {
    this.#palette = null;
    this.paint();
  }

  get #item() {
    return this.#shown?.items.find((item) => idOf(item) === this.#selected) ?? null;
  }

  get #grid() {
    return gridOf(this.#shown.run.scenario.room);
  }

  #middle(room) {
    const [left, bottom] = lowerLeft(room);
    const grid_m = gridOf(room);
    return { x: snap(left + room.width_m / 2, grid_m), y: snap(bottom + room.height_m / 2, grid_m) };
  }

  #pointUnder(event) {
    const box = this.#canvas.getBoundingClientRect();
    return this.#projection.point(event.clientX - box.left, event.clientY - box.top);
  }

  #near(a, b) {
    return Math.hypot(a.x - b.x, a.y - b.y) * this.#projection.scale <= NEAR_PX;
  }

  /** Returns the handles of the selected item: `[{handle, x, y}]`, m. */
  #handles() {
    const item = this.#item;
    if (!item) return [];
    const [outline] = item.outlines;
    if (outline.rectangle) {
      const [x, y] = outline.rectangle.max;
      return [{ handle: "corner", x, y }];
    }
    if (item.kind !== "robot" || item.outlines.length > 1) return [];
    const angle = (Math.PI / 180) * item.numbers.heading_deg;
    const far = outline.disc.radius_m + NOSE_PX / this.#projection.scale;
    return [{ handle: "heading", x: item.x_m + far * Math.cos(angle), y: item.y_m + far * Math.sin(angle) }];
  }

  #itemAt(point) {
    const within = (outline) => isWithin(point, outline) || this.#isNear(point, outline);
    return this.#shown.items.findLast(({ outlines }) => outlines.some(within)) ?? null;
  }

  /** Tests whether a point is beside a disc that is small on the canvas. */
  #isNear(point, { disc }) {
    if (!disc) return false;
    const [x, y] = disc.center;
    return this.#near(point, { x, y });
  }

  #press(event) {
    if (event.button !== 0 || !this.#shown) return;
    const point = this.#pointUnder(event);
    const at = { x: event.clientX, y: event.clientY };
    if (this.#tool) {
      this.#drag = { item: null, handle: null, from: point, to: point, hasMoved: false, at };
    } else {
      const handle = this.#handles().find((each) => this.#near(each, point))?.handle ?? null;
      const item = handle ? this.#item : this.#itemAt(point);
      this.#actions.select(item && idOf(item));
      if (!item) return;
      this.#drag = { item, handle, from: point, to: point, hasMoved: false, at };
    }
    this.#canvas.setPointerCapture(event.pointerId);
  }

  #move(event) {
    if (!this.#shown) return;
    const point = this.#pointUnder(event);
    if (this.#tool) this.#cursor = { x: snap(point.x, this.#grid), y: snap(point.y, this.#grid) };
    const drag = this.#drag;
    if (drag) {
      drag.to = point;
      drag.hasMoved ||= Math.hypot(event.clientX - drag.at.x, event.clientY - drag.at.y) > MAX_CLICK_PX;
    } else if (!this.#tool) {
      const found = this.#handles().some((each) => this.#near(each, point)) || this.#itemAt(point);
      this.#canvas.style.cursor = found ? "move" : "";
    }
    if (drag || this.#tool) this.paint();
  }

  #release(event) {
    const drag = this.#drag;
    this.#drag = null;
    if (!drag || !this.#shown) return;
    this.#move(event);
    if (!drag.item) this.#place(drag.hasMoved ? drag.from : this.#cursor, this.#cursor);
    else if (drag.hasMoved) this.#set(drag.item, dragged(drag.item, drag.handle, drag.from, drag.to, this.#grid));
    this.paint();
  }

  #cancel() {
    this.#drag = null;
    this.paint();
  }

  /** Adds an item of the tool's kind. A rectangle is between both points. */
  #place(from, to) {
    const values = isRectangle(this.#tool.kind) ? rectangleBetween(from, to, this.#grid) : { x_m: to.x, y_m: to.y };
    this.#actions.change({ add: { ...this.#tool, values } });
  }

  #set({ kind, index }, values) {
    this.#actions.change({ set: { kind, index, values } });
  }

  #key(event) {
    if (!this.#shown || event.ctrlKey || event.metaKey || event.altKey) return;
    const arrow = ARROWS[event.key];
    const item = this.#item;
    if (arrow && (this.#tool || item)) {
      const step_m = (event.shiftKey ? LONG_STEP : STEP) * this.#grid;
      const [dx, dy] = arrow.map((direction) => direction * step_m);
      if (this.#tool) {
        this.#cursor = { x: snap(this.#cursor.x + dx, this.#grid), y: snap(this.#cursor.y + dy, this.#grid) };
        this.paint();
      } else {
        this.#actions.move(dx, dy);
      }
    } else if (event.key === "Enter" && this.#tool) {
      this.#place(this.#cursor, this.#cursor);
    } else if (event.key === "PageDown" || event.key === "PageUp") {
      const next = neighbor(this.#shown.items, this.#selected, event.key === "PageDown" ? 1 : -1);
      if (next) this.#actions.select(idOf(next));
    } else if ((event.key === "Delete" || event.key === "Backspace") && item) {
      this.#actions.remove();
    } else if (event.key === "Escape" && (this.#tool || item)) {
      if (this.#tool) this.#actions.drop();
      else this.#actions.select(null);
    } else {
      return;
    }
    event.preventDefault();
  }

  paint() {
    const { clientWidth: width, clientHeight: height } = this.#canvas.parentElement;
    if (!this.#shown || width === 0 || height === 0) return;
    const { run, view } = this.#shown;
    const { scenario } = run;
    this.#palette ??= paint.readPalette(run.colors.tasks);
    attribute(this.#canvas, "width", Math.round(width * devicePixelRatio));
    attribute(this.#canvas, "height", Math.round(height * devicePixelRatio));
    const p = new Projection(scenario.room, width, height, MARGIN_PX, new Lens(scenario.room), paint.SCALE_SPACE_PX);
    this.#projection = p;
    const palette = this.#palette;
    const c = this.#canvas.getContext("2d");
    c.setTransform(devicePixelRatio, 0, 0, devicePixelRatio, 0, 0);
    c.fillStyle = palette.outside;
    c.fillRect(0, 0, width, height);
    paint.paintFloor(c, p, scenario.room, palette);
    paint.paintMarks(c, p, view.marks, palette);
    for (const obstacle of view.obstacles) paint.paintObstacle(c, p, obstacle, "", palette);
    paint.paintBorder(c, p, scenario.room, palette);
    paint.paintScale(c, p, scenario.room, palette);
    paint.paintItems(c, p, view, scenario.body.radius_m, palette);
    paint.paintMarkLabels(c, paint.findMarkLabels(c, p, scenario.room, view.marks).labels, palette);
    const letters = signs(scenario.robots.map(({ name }) => name));
    view.robots.forEach((robot, rank) => {
      const style = { radius_m: scenario.body.radius_m, least_px: LEAST_PX, color: run.colors.robots[rank], sign: letters[rank], isSelected: false };
      // A robot that joins later is drawn like one that is joining.
      const state = robot.state === "absent" ? "coming" : "present";
      paintBody(c, p, { ...robot, state }, style, palette);
    });
    this.#paintSelection(c, p, palette);
    this.#paintTool(c, p, palette);
    this.#describe();
  }

  #paintSelection(c, p, palette) {
    const item = this.#item;
    if (!item) return;
    let outlines = item.outlines;
    const drag = this.#drag?.hasMoved && this.#drag.item ? this.#drag : null;
    const values = drag && dragged(item, drag.handle, drag.from, drag.to, this.#grid);
    if (values?.width_m) {
      const max = [values.x_m + values.width_m, values.y_m + values.height_m];
      outlines = [{ rectangle: { min: [values.x_m, values.y_m], max } }];
    } else if (values) {
      outlines = outlines.map((outline) => shifted(outline, values.x_m - item.x_m, values.y_m - item.y_m));
    }
    c.strokeStyle = palette.select;
    c.lineWidth = 3;
    for (const outline of outlines) {
      paint.outlined(c, p, outline);
      c.stroke();
    }
    c.fillStyle = palette.select;
    for (const { handle, x, y } of this.#handles()) {
      const to = drag?.handle === handle ? drag.to : drag ? null : { x, y };
      if (to) c.fillRect(p.x(to.x) - HANDLE_PX / 2, p.y(to.y) - HANDLE_PX / 2, HANDLE_PX, HANDLE_PX);
    }
  }

  #paintTool(c, p, palette) {
    if (!this.#tool || !this.#cursor) return;
    const drag = this.#drag?.hasMoved ? this.#drag : null;
    const { x, y } = this.#cursor;
    c.strokeStyle = palette.select;
    c.lineWidth = 2;
    if (drag && isRectangle(this.#tool.kind)) {
      const { x_m, y_m, width_m = 0, height_m = 0 } = rectangleBetween(drag.from, this.#cursor, this.#grid);
      c.strokeRect(p.x(x_m), p.y(y_m + height_m), p.scale * width_m, p.scale * height_m);
    }
    paint.paintPointer(c, p, { x, y }, palette);
  }

  /** Sets the text alternative of the picture. */
  #describe() {
    const item = this.#item;
    const at = (x, y) => `${meters(x)}, ${meters(y)}`;
    const now = this.#tool
      ? `New ${this.#tool.kind} at ${at(this.#cursor.x, this.#cursor.y)}`
      : item
        ? `${item.label} at ${at(item.x_m, item.y_m)}`
        : `${this.#shown.items.length} items, none selected`;
    attribute(this.#canvas, "aria-label", `Drawing of the scenario. ${now}`);
    // For tests.
    attribute(this.#canvas, "data-tool", this.#tool ? this.#tool.kind : "look");
  }

  /** Returns the place of a point of the room in the window, CSS pixels. */
  toScreen(x_m, y_m) {
    const box = this.#canvas.getBoundingClientRect();
    return { x: box.left + this.#projection.x(x_m), y: box.top + this.#projection.y(y_m) };
  }
}
