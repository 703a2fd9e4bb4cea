// The table of radio links, senders down and receivers across, with recent losses. A large team has only the links of
// the selected robot. A click opens the menu of a link.

import { reception } from "../model/channel.js";
import { affectsLink, inForce, linkState } from "../model/faults.js";
import { attribute, byId, el, text } from "../ui/dom.js";
import { closeMenu, numberField, openMenu } from "../ui/menu.js";
import { isShown } from "../ui/tabs.js";
import { count as counted, faultInWords, percent } from "../ui/words.js";
import { chosenDuration } from "../room/tools.js";

/** Teams above this size have a table of the selected robot's links only. */
const ALL_LINKS = 16;

/** Returns the losses and delays of a link in words. */
function losses({ count, lost, late }) {
  return `${lost} of the last ${counted(count, "message")} lost, ${late} late`;
}

export class Links {
  #model;
  #choices;
  #orders;
  #cells = [];
  // The content of the table: a rank, "all", or null.
  #built = null;

  constructor(model, choices, orders) {
    this.#model = model;
    this.#choices = choices;
    this.#orders = orders;
  }

  /** Builds the table, unless it has this content already. */
  #build(content) {
    if (this.#built === content) return;
    this.#built = content;
    this.#cells = [];
    if (content === "all") this.#buildAll();
    else if (content === null) byId("link-table").replaceChildren();
    else this.#buildOf(content);
  }

  #buildOf(rank) {
    const { names } = this.#model;
    const head = ["teammate", `from ${names[rank]}`, `to ${names[rank]}`].map((each) => el("th", { scope: "col" }, each));
    const rows = names.flatMap((name, other) => {
      if (other === rank) return [];
      const cells = [this.#cell(rank, other, names[rank], name), this.#cell(other, rank, name, names[rank])];
      return [el("tr", {}, el("th", { scope: "row" }, name), ...cells)];
    });
    byId("link-table").classList.remove("dense");
    byId("link-table").replaceChildren(el("thead", {}, el("tr", {}, ...head)), el("tbody", {}, ...rows));
  }

  #buildAll() {
    const { names } = this.#model;
    const head = el(
      "tr",
      {},
      el("th", { scope: "col" }, "from ↓ to →"),
      ...names.map((name) => el("th", { scope: "col" }, name)),
    );
    const rows = names.map((sender, from) =>
      el("tr", {}, el("th", { scope: "row" }, sender), ...names.map((receiver, to) => this.#cell(from, to, sender, receiver))),
    );
    byId("link-table").classList.toggle("dense", names.length > 6);
    byId("link-table").replaceChildren(el("thead", {}, head), el("tbody", {}, ...rows));
  }

  #cell(from, to, sender, receiver) {
    if (from === to) return el("td", { class: "dim" }, "·");
    const button = el("button", {
      type: "button",
      "data-link": `${sender}>${receiver}`,
      onclick: () => this.open(from, to, button),
    });
    this.#cells.push({ from, to, button });
    return el("td", {}, button);
  }

  draw() {
    const { view, names, traffic, now, run } = this.#model;
    if (!isShown("links") || !view) return;
    const isSmall = names.length <= ALL_LINKS;
    this.#build(isSmall ? "all" : this.#choices.selected);
    byId("links-whose").hidden = isSmall || this.#choices.selected !== null;
    const faults = inForce(view);
    text(byId("links-left-out"), traffic.leftOut ? "Some messages did not reach this page; the table does not count them." : "");
    for (const { from, to, button } of this.#cells) {
      const link = traffic.link(from, to, now);
      const isDisturbed = faults.some((fault) => affectsLink(fault, names[from], names[to]));
      const isUsed = [from, to].every((rank) => view.robots[rank].state !== "absent");
      const { loss, isCut, isHeld } = linkState(link, faults, names[from], names[to]);
      const isStopped = isCut || isHeld;
      const state = !isUsed ? "unused" : isCut ? "cut" : isHeld ? "held" : link.count === 0 ? "unused" : loss > 0 ? "lossy" : link.late ? "late" : "good";
      const sign = { unused: "–", cut: "⊘ cut", held: "◷ held", lossy: `✗ ${percent(loss)}`, late: "◷ late", good: "✓" }[state];
      const shown = isDisturbed ? `${sign} ⚡` : sign;
      text(button, shown);
      attribute(button, "data-state", state);
      attribute(button, "data-loss", link.count ? loss.toFixed(2) : "");
      attribute(button, "data-disturbed", isDisturbed ? "yes" : "no");
      const words = `${isUsed && isStopped ? `${state}, ` : ""}${link.count ? losses(link) : "no recent messages"}`;
      const places = [from, to].map((rank) => view.robots[rank].pose.position);
      const expected = run.scenario.radio ? `, ${percent(reception(run.scenario.radio, ...places, view.obstacles))} expected to arrive` : "";
      const description = `${words}${expected}${isDisturbed ? ", affected by a fault" : ""}`;
      // The name contains the visible text, so that a user of voice control can say it.
      attribute(button, "aria-label", `${names[from]} to ${names[to]}: ${shown}, ${description}`);
      attribute(button, "title", `${names[from]} to ${names[to]}: ${description}`);
    }
  }

  /** Opens the menu of a link next to `at` (see openMenu). */
  open(from, to, at) {
    const { names, traffic, now } = this.#model;
    const [sender, receiver] = [names[from], names[to]];
    const { count, lost, late } = traffic.link(from, to, now);
    const state = count ? `${losses({ count, lost, late })}.` : "No recent messages.";
    const content = [el("p", {}, state), this.#disturbances(sender, receiver)];
    if (this.#model.isOpen) content.push(this.#actions(sender, receiver));
    openMenu(`${sender} → ${receiver}`, at, ...content);
  }

  #disturbances(sender, receiver) {
    const found = this.#model.view.faults.filter(({ phase }) => phase === "in-force").filter(({ order }) => affectsLink(order.fault, sender, receiver));
    if (!found.length) return null;
    const rows = found.map(({ id, order }) => {
      const undo = () => (this.#orders.clear(id), closeMenu());
      return el(
        "li",
        {},
        `${id}: ${faultInWords(order.fault, this.#model.run.faults)} `,
        this.#model.isOpen ? el("button", { type: "button", "data-undo": id, onclick: undo }, "Undo") : null,
      );
    });
    return el("ul", { class: "plain" }, ...rows);
  }

  #actions(sender, receiver) {
    const delay = numberField("Delay, s", { min: 0.05, step: 0.05, value: 0.5, id: "link-delay" });
    const loss = numberField("Loss, %", { min: 1, max: 100, step: 1, value: 30, id: "link-loss" });
    const both = el("input", { type: "checkbox", id: "link-both" });
    const duration = numberField("Duration, s", {
      min: 0.05,
      step: "any",
      value: chosenDuration() ?? "",
      placeholder: "until undone",
      id: "link-for",
    });
    // Each direction needs its own fault; only a partition covers both.
    const arm = async (make) => {
      closeMenu();
      const for_s = duration.input.valueAsNumber > 0 ? duration.input.valueAsNumber : null;
      for (const fault of make(both.checked)) await this.#orders.arm(fault, for_s);
    };
    const ends = (isBoth) =>
      (isBoth
        ? [
            [sender, receiver],
            [receiver, sender],
          ]
        : [[sender, receiver]]
      ).map(([from, to]) => ({ from, to }));
    const act = (action, label, make) => el("button", { type: "button", "data-action": action, onclick: () => arm(make) }, label);
    return el(
      "div",
      { class: "choices" },
      // Later groups still receive from earlier ones, so the receiver is in the first group.
      act("cut", "Cut", (isBoth) => [{ partition: { groups: [[receiver], [sender]], one_way: !isBoth } }]),
      act("hold", "Hold", (isBoth) => ends(isBoth).map((link) => ({ hold: link }))),
      el(
        "div",
        { class: "row" },
        delay.element,
        act("delay", "Delay", (isBoth) =>
          ends(isBoth).map((link) => ({ delay: { ...link, delay_s: delay.input.valueAsNumber } })),
        ),
      ),
      el(
        "div",
        { class: "row" },
        loss.element,
        act("drop", "Drop", (isBoth) =>
          ends(isBoth).map((link) => ({ drop: { ...link, p: loss.input.valueAsNumber / 100 } })),
        ),
      ),
      el("label", { class: "check" }, both, "both directions"),
      duration.element,
    );
  }
}
