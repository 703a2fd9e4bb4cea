// The list of broadcasts, newest first, with the delivery at each receiver.

import { byId, dot, el, keyed, text } from "../ui/dom.js";
import { isShown } from "../ui/tabs.js";
import { DELIVERIES, count as counted, seconds } from "../ui/words.js";

const MAX_ROWS = 120;
/** Up to this number of receivers, each is named. */
const MAX_NAMED = 6;

/** Kinds of bulletins; the mission has the names. */
const BULLETINS = ["FirstBulletin", "SecondBulletin"];

const isGood = (delivery) => ["Received", "Delayed", "Damaged"].includes(delivery);

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
    for (let index = traffic.broadcasts.length - 1; index >= 0 && rows.length < MAX_ROWS; index -= 1) {
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
      traffic.leftOut ? `${counted(traffic.leftOut, "reception")} did not reach this page.` : "",
      traffic.skippedTicks ? `Messages of ${counted(traffic.skippedTicks, "skipped tick")} are missing.` : "",
    ];
    text(byId("messages-left-out"), gaps.join(" ").trim());
  }

  #isWanted({ sender, content, receptions }) {
    const [kind, robot, delivery] = ["message-kind", "message-robot", "message-delivery"].map((id) => byId(id).value);
    if (kind && content?.kind !== kind && !(kind === "Heartbeat" && !content)) return false;
    if (robot && Number(robot) !== sender && !receptions.has(Number(robot))) return false;
    return !delivery || [...receptions.values()].some((each) => each !== "Received" && each !== "Pending");
  }

  #row({ sender, sent, content }) {
    const { names, colors, sets, tasks } = this.#model;
    const subject = content?.set !== null && content?.set !== undefined ? sets[content.set]?.name : tasks[content?.task]?.name;
    const claim = [content?.state?.toLowerCase(), subject].filter(Boolean).join(" ");
    const details = content ? [claim, content.progress ? `progress ${content.progress}` : null] : ["never arrived"];
    return el(
      "li",
      { "data-message": content?.kind ?? "unknown", "data-sender": names[sender], "data-t": sent },
      el("span", { class: "time" }, seconds(sent, 2)),
      dot(colors[sender]),
      el(
        "span",
        {},
        el("strong", {}, `${names[sender]} `),
        content ? this.#kind(content.kind) : "message",
        el("span", { class: "dim" }, ` ${details.filter(Boolean).join(", ")}`),
      ),
      el("span", { class: "deliveries" }),
    );
  }

  #fill(row, { receptions, duplicates }) {
    const bad = [...receptions.values()].some((delivery) => !isGood(delivery) && delivery !== "Pending");
    row.dataset.delivery = bad ? "lost" : [...receptions.values()].every((delivery) => delivery === "Received") ? "received" : "late";
    const all = [...receptions].sort(([a], [b]) => a - b);
    const isLarge = this.#model.names.length - 1 > MAX_NAMED;
    // In a large team successful receptions are only counted.
    const named = isLarge ? all.filter(([, delivery]) => delivery !== "Received").slice(0, MAX_NAMED) : all;
    const items = named.map(([receiver, delivery]) => ({ key: receiver, receiver, delivery, isDuplicate: duplicates.has(receiver) }));
    if (isLarge) items.unshift({ key: "received", count: all.filter(([, delivery]) => delivery === "Received").length });
    keyed(
      row.lastChild,
      items,
      (item) => item.key,
      () => el("span"),
      (element, item) => this.#delivery(element, item),
    );
  }

  #delivery(element, { receiver, delivery, isDuplicate, count }) {
    if (count !== undefined) {
      text(element, `✓ ${count}`);
      element.title = `received by ${counted(count, "robot")}`;
      return;
    }
    const { sign, word } = DELIVERIES[delivery];
    const again = isDuplicate ? ` ${DELIVERIES.Duplicate.sign}` : "";
    element.dataset.receiver = this.#model.names[receiver];
    element.dataset.delivery = delivery;
    text(element, `${sign} ${this.#model.names[receiver]}${again}`);
    element.title = `${this.#model.names[receiver]}: ${word}${isDuplicate ? `, ${DELIVERIES.Duplicate.word}` : ""}`;
  }
}
