// The stream of heartbeats and bulletins, newest first, with what became of each at every receiver.

import { byId, dot, el, keyed, text } from "../ui/dom.js";
import { isShown } from "../ui/tabs.js";
import { DELIVERIES, seconds } from "../ui/words.js";

/** Rows at most. */
const ROWS = 120;
/** Receivers are named one by one up to so many. */
const NAMED = 6;

/** Kinds of bulletins; the mission names them. */
const BULLETINS = ["FirstBulletin", "SecondBulletin"];

const isGood = (delivery) => delivery === "Heard" || delivery === "Delayed";

export class Messages {
  #model;

  constructor(model) {
    this.#model = model;
    const { names } = model;
    byId("message-kind").append(...BULLETINS.map((kind) => el("option", { value: kind }, this.#kind(kind))));
    byId("message-robot").append(...names.map((name, rank) => el("option", { value: rank }, name)));
    for (const id of ["message-kind", "message-robot", "message-delivery"]) byId(id).addEventListener("change", () => this.draw());
  }

  #kind(kind) {
    return this.#model.run.mission.bulletins[BULLETINS.indexOf(kind)] ?? kind;
  }

  draw() {
    if (!isShown("messages")) return;
    const { traffic } = this.#model;
    const rows = [];
    for (let index = traffic.broadcasts.length - 1; index >= 0 && rows.length < ROWS; index -= 1) {
      if (this.#isWanted(traffic.broadcasts[index])) rows.push(traffic.broadcasts[index]);
    }
    keyed(
      byId("message-list"),
      rows,
      (broadcast) => broadcast.key,
      (broadcast) => this.#row(broadcast),
      (row, broadcast) => this.#fill(row, broadcast),
    );
    const gaps = [
      traffic.leftOut ? `${traffic.leftOut} receptions were left out to keep up.` : "",
      traffic.skipped ? `The messages of ${traffic.skipped} ticks that were not shown are missing.` : "",
    ];
    text(byId("messages-left-out"), gaps.join(" ").trim());
  }

  #isWanted({ sender, said, receptions }) {
    const [kind, robot, delivery] = ["message-kind", "message-robot", "message-delivery"].map((id) => byId(id).value);
    if (kind && said?.kind !== kind && !(kind === "Heartbeat" && !said)) return false;
    if (robot && Number(robot) !== sender && !receptions.has(Number(robot))) return false;
    return !delivery || [...receptions.values()].some((each) => each !== "Heard" && each !== "Pending");
  }

  #row({ sender, sent, said }) {
    const { names, colors, sets, tasks } = this.#model;
    const subject = said?.set !== null && said?.set !== undefined ? sets[said.set]?.name : tasks[said?.task]?.name;
    const claim = [said?.state?.toLowerCase(), subject].filter(Boolean).join(" ");
    const details = said ? [claim, said.progress ? `progress ${said.progress}` : null] : ["never arrived"];
    return el(
      "li",
      { "data-message": said?.kind ?? "unknown", "data-sender": names[sender], "data-t": sent },
      el("span", { class: "time" }, seconds(sent, 2)),
      dot(colors[sender]),
      el(
        "span",
        {},
        el("strong", {}, `${names[sender]} `),
        said ? this.#kind(said.kind) : "message",
        el("span", { class: "dim" }, ` ${details.filter(Boolean).join(", ")}`),
      ),
      el("span", { class: "deliveries" }),
    );
  }

  #fill(row, { receptions, twice }) {
    const bad = [...receptions.values()].some((delivery) => !isGood(delivery) && delivery !== "Pending");
    row.dataset.delivery = bad ? "lost" : [...receptions.values()].every((delivery) => delivery === "Heard") ? "heard" : "late";
    const all = [...receptions].sort(([a], [b]) => a - b);
    const many = this.#model.names.length - 1 > NAMED;
    // A large team: those who heard are only counted.
    const named = many ? all.filter(([, delivery]) => delivery !== "Heard").slice(0, NAMED) : all;
    const items = named.map(([receiver, delivery]) => ({ key: receiver, receiver, delivery, twice: twice.has(receiver) }));
    if (many) items.unshift({ key: "heard", count: all.filter(([, delivery]) => delivery === "Heard").length });
    keyed(
      row.lastChild,
      items,
      (item) => item.key,
      () => el("span"),
      (element, item) => this.#delivery(element, item),
    );
  }

  #delivery(element, { receiver, delivery, twice, count }) {
    if (count !== undefined) {
      text(element, `✓ ${count}`);
      element.title = `heard by ${count}`;
      return;
    }
    const { sign, word } = DELIVERIES[delivery];
    const again = twice ? ` ${DELIVERIES.Duplicate.sign}` : "";
    element.dataset.receiver = this.#model.names[receiver];
    element.dataset.delivery = delivery;
    text(element, `${sign} ${this.#model.names[receiver]}${again}`);
    element.title = `${this.#model.names[receiver]}: ${word}${twice ? `, ${DELIVERIES.Duplicate.word}` : ""}`;
  }
}
