// A second run beside the first one: the same scenario, seed and orders with another allocator, in a room of its own, and a
// table of the figures in which the two runs differ.

import { HEADINGS, ahead, figuresOf, shown } from "../model/compare.js";
import { Model } from "../model/model.js";
import { Room } from "../room/room.js";
import { followLive } from "../source/live.js";
import { attribute, byId, el, text } from "../ui/dom.js";

export class Beside {
  #models;
  #room;
  /** The heads and cells of each run's row, in the order of the models. */
  #rows;
  #verdict = el("caption", {});

  /** Shows the second run of `engine` beside `model`, with the same choices. Returns null if there is none. */
  static of(engine, run, model, choices, changed) {
    return run.beside ? new Beside(engine, run, model, choices, changed) : null;
  }

  constructor(engine, run, model, choices, changed) {
    this.#models = [model, new Model(run.beside, changed)];
    const names = [run, run.beside].map(({ scenario }) => scenario.allocator ?? "alliance");
    const label = (name, side) => el("h2", { class: "room-name" }, name, el("span", { class: "dim" }, `, ${side}`));
    const canvas = el("canvas", { id: "beside-canvas", role: "img", "aria-label": "The room of the second run seen from above" });
    byId("room").append(label(names[0], "first run"));
    byId("room").after(el("div", { id: "beside-room" }, canvas, label(names[1], "second run")));
    this.#rows = names.map((name) => {
      const cells = [...HEADINGS, "hash"].map((heading) => el("td", { "data-figure": heading }));
      return { element: el("tr", {}, el("th", { scope: "row" }, name), ...cells), cells };
    });
    const heads = ["allocator", ...HEADINGS, "hash"].map((heading) => el("th", { scope: "col" }, heading));
    const table = el("table", {}, this.#verdict, el("thead", {}, el("tr", {}, ...heads)), el("tbody", {}, ...this.#rows.map(({ element }) => element)));
    // The table scrolls in a narrow window, also by the keyboard.
    const box = el("div", { id: "comparison", tabindex: 0, role: "region", "aria-label": "Comparison of the two runs" }, table);
    byId("room-panel").append(box);
    document.body.toggleAttribute("data-beside", true);
    this.#room = new Room(canvas, this.#models[1], choices);
    followLive({ openLiveSocket: () => engine.beside }, this.#models[1]);
  }

  /** Reads the theme's colors again. */
  refreshPalette() {
    this.#room.refreshPalette();
  }

  draw() {
    this.#room.draw();
    if (this.#models.some(({ view }) => view === null)) return;
    const figures = this.#models.map(figuresOf);
    const leader = ahead(figures);
    figures.forEach((each, index) => {
      const { element, cells } = this.#rows[index];
      [...shown(each), this.#models[index].hash].forEach((value, column) => text(cells[column], value));
      attribute(element, "data-ahead", leader?.index === index);
    });
    const name = leader && this.#rows[leader.index].element.firstChild.textContent;
    text(this.#verdict, leader ? `${name} is ahead: ${leader.why}` : "Neither run is ahead");
  }
}

/** Adds the choice of the second run's allocator to the form. */
export function offerBeside(list, choice) {
  const options = list.allocators.map(({ name, about }) => el("option", { value: name, title: about }, name));
  const select = el("select", { id: "choose-beside" }, el("option", { value: "" }, "no second run"), ...options);
  select.value = choice.beside ?? "";
  const about = "A second run beside the first one: the same scenario, seed and orders with this allocator";
  byId("choose-allocator").parentElement.after(el("label", { title: about }, "beside ", select));
}
