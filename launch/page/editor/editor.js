// The editor of the playground: a drawing and the text of one scenario. Each changes the other through the simulator, which
// also checks every change.

import { linkOf } from "../model/choice.js";
import { Versions, dragged, gridOf, idOf, plainName } from "../model/draft.js";
import { attribute, byId, el, keyed, text } from "../ui/dom.js";
import { count } from "../ui/words.js";
import { Drawing } from "./drawing.js";
import { keepVersions, keptVersions, readFile, saveFile } from "./files.js";
import { Source } from "./source.js";

/** The time after a key press until the text is drawn, ms. */
const TYPING_MS = 250;

/** Shows the button of the editor. `choice` is the run of the page. */
export function offerEditor(engine, choice) {
  let editor = null;
  byId("edit").hidden = false;
  byId("edit").addEventListener("click", () => {
    editor ??= new Editor(engine, choice);
    editor.open();
  });
}

class Editor {
  #engine;
  #choice;
  // The scenario that was chosen on the page when the editor opened.
  #origin = null;
  #versions = keptVersions();
  // The latest drawing, and the file that it shows. A text with a problem has no drawing.
  #drawing = null;
  #drawn = null;
  #problem = null;
  #selected = null;
  #tool = null;
  #timer = null;
  // Requests follow each other, so that each change refers to the text of the one before.
  #queue = Promise.resolve();
  #source = new Source((value) => this.#typed(value));
  #picture = new Drawing(byId("edit-canvas"), {
    select: (id) => this.#select(id),
    change: (change) => this.#change(() => change),
    move: (dx, dy) => this.#move(dx, dy),
    remove: () => this.#remove(),
    drop: () => this.#take(null),
  });

  constructor(engine, choice) {
    this.#engine = engine;
    this.#choice = choice;
    const clicks = {
      undo: () => this.#undo(),
      redo: () => this.#redo(),
      open: () => byId("edit-file").click(),
      download: () => saveFile(this.#file.name, this.#file.text),
      share: () => this.#share(),
      run: () => this.#run(),
      close: () => byId("editor").close(),
      delete: () => this.#remove(),
    };
    for (const [name, action] of Object.entries(clicks)) byId(`edit-${name}`).addEventListener("click", action);
    byId("edit-file").addEventListener("change", ({ target }) => this.#read(target));
    byId("edit-item").addEventListener("change", ({ target }) => this.#select(target.value || null));
    // The focus may be outside of the window, after the click of a button.
    document.addEventListener("keydown", (event) => byId("editor").open && this.#key(event));
    addEventListener("pagehide", () => this.#versions && keepVersions(this.#versions));
    const themes = new MutationObserver(() => this.#picture.refreshPalette());
    themes.observe(document.documentElement, { attributeFilter: ["data-theme"] });
    window.allianceEditor = Object.freeze({
      /** Returns the place of a point of the room in the window, CSS pixels. For tests and the console. */
      toScreen: (x_m, y_m) => this.#picture.toScreen(x_m, y_m),
    });
  }

  /** Opens the window with the scenario of the page's form, or with the one that is being edited. */
  async open() {
    const scenario = byId("choose-scenario").value;
    const isNew = scenario !== this.#origin;
    this.#origin = scenario;
    await (isNew ? this.#load(scenario ? { scenario } : { file: this.#choice.file }) : this.#redraw());
    byId("editor").showModal();
  }

  /** Returns the allocator and the seed of the page's form. */
  get #conditions() {
    return { allocator: byId("choose-allocator").value || null, seed: byId("choose-seed").value || null };
  }

  get #file() {
    return this.#versions.file;
  }

  /** Executes a step after those before it. */
  #enqueue(step) {
    this.#queue = this.#queue.then(step).catch((error) => this.#say({ text: error.message, line: null }));
    return this.#queue;
  }

  /** Edits another scenario: `{scenario}` or `{file}`. The present one can be restored. */
  #load(scenario) {
    return this.#enqueue(async () => {
      this.#selected = this.#tool = null;
      const answer = await this.#engine.edit({ ...scenario, ...this.#conditions });
      const file = { name: answer.name, text: answer.text };
      if (this.#versions) this.#versions.add(file, null, performance.now());
      else this.#versions = new Versions(file);
      this.#receive(answer);
    });
  }

  #typed(text) {
    this.#versions.add({ ...this.#file, text }, "typing", performance.now());
    this.#showButtons();
    clearTimeout(this.#timer);
    this.#timer = setTimeout(() => this.#redraw(), TYPING_MS);
  }

  #redraw() {
    return this.#enqueue(async () => {
      const file = this.#file;
      const answer = await this.#engine.edit({ file, ...this.#conditions });
      // Otherwise a person has typed, and the next drawing follows.
      if (file === this.#file) this.#receive(answer);
    });
  }

  /** Changes the text by the change of an item that `make` returns, if any. `step` joins changes for undo. */
  #change(make, step = null) {
    this.#enqueue(async () => {
      const file = this.#file;
      // The numbers of items are those of the drawn text.
      const change = file === this.#drawn && make();
      if (!change) return;
      const answer = await this.#engine.edit({ file, ...this.#conditions }, change);
      if (file !== this.#file) return;
      if (answer.problem) {
        this.#say({ text: `Not changed: ${answer.problem.text}`, line: null });
        this.#showNumbers();
        return;
      }
      this.#versions.add({ name: file.name, text: answer.text }, step, performance.now());
      if (change.add) {
        this.#tool = null;
        this.#selected = idOf(answer.drawing.items.findLast(({ kind }) => kind === change.add.kind));
      }
      if (change.delete) this.#selected = null;
      this.#receive(answer);
    });
  }

  get #item() {
    return this.#drawing?.items.find((item) => idOf(item) === this.#selected) ?? null;
  }

  /** Moves the selected item by a distance, m. */
  #move(dx, dy) {
    const make = () => {
      // The place after the moves before.
      const item = this.#item;
      const grid_m = gridOf(this.#drawing.run.scenario.room);
      const values = item && dragged(item, null, { x: 0, y: 0 }, { x: dx, y: dy }, grid_m);
      return item && { set: { kind: item.kind, index: item.index, values } };
    };
    this.#change(make, `move ${this.#selected}`);
  }

  #remove() {
    const item = this.#item;
    if (item) this.#change(() => ({ delete: { kind: item.kind, index: item.index } }));
  }

  #undo() {
    this.#versions.undo();
    this.#redraw();
  }

  #redo() {
    this.#versions.redo();
    this.#redraw();
  }

  #select(id) {
    this.#selected = id;
    this.#show();
  }

  #take(tool) {
    const isSame = tool && this.#tool && tool.kind === this.#tool.kind && tool.variant === this.#tool.variant;
    this.#tool = isSame ? null : tool;
    this.#show();
    if (this.#tool) byId("edit-canvas").focus();
  }

  async #read(field) {
    const [file] = field.files;
    // The same file can be opened again.
    if (!file) return;
    try {
      const content = await readFile(file);
      this.#load({ file: { name: plainName(file.name), text: content } });
    } catch (error) {
      this.#say({ text: error.message, line: null });
    }
    field.value = "";
  }

  #link() {
    return linkOf({ file: this.#file, ...this.#conditions }, this.#engine.version);
  }

  async #share() {
    const link = new URL(await this.#link(), location.href).href;
    const copied = await navigator.clipboard?.writeText(link).then(() => true, () => false);
    if (!copied) history.replaceState(null, "", link);
    this.#source.showProblem(this.#problem, copied ? "The link is copied" : "The address of this page is the link: copy it");
  }

  async #run() {
    const link = await this.#link();
    // Another link starts the page again. The same one starts the run again.
    if (location.hash === link) location.reload();
    else location.hash = link;
  }

  #key(event) {
    const isCommand = event.ctrlKey || event.metaKey;
    const key = event.key.toLowerCase();
    if (isCommand && key === "z") (event.shiftKey ? () => this.#redo() : () => this.#undo())();
    else if (isCommand && key === "y") this.#redo();
    else if (isCommand && key === "enter") this.#run();
    else return;
    event.preventDefault();
  }

  #receive({ drawing = null, problem = null }) {
    this.#problem = problem;
    if (drawing) [this.#drawing, this.#drawn] = [drawing, this.#file];
    if (!this.#item) this.#selected = null;
    this.#show();
  }

  /** Shows a line below the text, until the next change. */
  #say(problem) {
    this.#source.showProblem(problem, "");
  }

  #show() {
    text(byId("editor-title"), this.#file.name);
    this.#source.show(this.#file.text);
    const run = this.#drawing?.run;
    const robots = run && count(run.scenario.robots.length, "robot");
    this.#source.showProblem(this.#problem, run ? `No problem: ${robots}, mission ${run.mission.name}` : "");
    attribute(byId("edit-drawing"), "data-stale", this.#problem !== null);
    this.#showButtons();
    if (!this.#drawing) return;
    this.#showTools();
    this.#showItems();
    this.#showNumbers();
    this.#picture.show(this.#drawing, this.#selected, this.#tool);
  }

  #showButtons() {
    byId("edit-undo").disabled = !this.#versions.canUndo;
    byId("edit-redo").disabled = !this.#versions.canRedo;
    byId("edit-run").disabled = this.#problem !== null;
  }

  #showTools() {
    const nameOf = ({ kind, variant }) => (variant ? `${kind}: ${variant}` : kind);
    const create = (tool) => {
      const name = nameOf(tool);
      const title = `Place a ${name} with a click, or with the arrow keys and Enter`;
      return el("button", { type: "button", title, "data-new": name, onclick: () => this.#take(tool) }, `+ ${name}`);
    };
    const update = (button, tool) => {
      attribute(button, "aria-pressed", String(this.#tool !== null && nameOf(tool) === nameOf(this.#tool)));
    };
    keyed(byId("edit-tools"), this.#drawing.kinds, nameOf, create, update);
  }

  #showItems() {
    const options = this.#drawing.items.map((item) => el("option", { value: idOf(item) }, item.label));
    byId("edit-item").replaceChildren(el("option", { value: "" }, "select an item"), ...options);
    byId("edit-item").value = this.#selected ?? "";
    byId("edit-delete").disabled = this.#selected === null;
  }

  #showNumbers() {
    const { x_m, y_m, numbers } = this.#item ?? {};
    const fields = Object.entries(this.#item ? { x_m, y_m, ...numbers } : {});
    const create = ([key]) => {
      const onchange = ({ target }) => this.#setNumber(key, target.valueAsNumber);
      return el("label", { class: "inline" }, key, el("input", { type: "number", step: "any", "data-number": key, onchange }));
    };
    const update = (label, [, value]) => {
      label.querySelector("input").value = value;
    };
    keyed(byId("edit-numbers"), fields, ([key]) => key, create, update);
  }

  #setNumber(key, value) {
    const { kind, index, x_m, y_m } = this.#item;
    // The place stays, also of a robot that does not state it.
    if (Number.isFinite(value)) this.#change(() => ({ set: { kind, index, values: { x_m, y_m, [key]: value } } }));
    else this.#showNumbers();
  }
}
