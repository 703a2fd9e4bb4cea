// What a click on an obstacle offers: what it is, and its removal where a fault has put it there.

import { el } from "../ui/dom.js";
import { closeMenu, openMenu } from "../ui/menu.js";
import { meters, seconds } from "../ui/words.js";

function nature({ penetrability }) {
  if (penetrability <= 0.1) return "Solid.";
  if (penetrability === 1) return "Without effect.";
  return penetrability < 1 ? `Slows down to ${penetrability} of the speed.` : `Speeds up to ${penetrability} times the speed.`;
}

/** `fault`: the one in force behind the obstacle, if any; `isOpen`: orders can be given. */
export function obstacleMenu(obstacle, fault, orders, isOpen, at) {
  const { x_m, y_m, width_m, height_m } = obstacle;
  const origin = fault
    ? `Put there by ${fault.id}, in force since ${seconds(fault.applied_ms, 2)}.`
    : "It belongs to the scenario and stays.";
  const remove = () => (orders.clear(fault.id), closeMenu());
  openMenu(
    `Obstacle, ${meters(width_m)} × ${meters(height_m)}`,
    at,
    el("p", {}, `Its lower left corner is at ${meters(x_m)}, ${meters(y_m)}. ${nature(obstacle)} ${origin}`),
    fault && isOpen
      ? el(
          "div",
          { class: "choices" },
          el("button", { type: "button", "data-action": "remove", "data-undo": fault.id, onclick: remove }, "Remove it"),
        )
      : null,
  );
}
