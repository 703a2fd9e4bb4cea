// The menu of an obstacle: size, effect and origin, and its removal if a fault put it there.

import { el } from "../ui/dom.js";
import { closeMenu, openMenu } from "../ui/menu.js";
import { meters, seconds } from "../ui/words.js";

function effect({ penetrability }) {
  if (penetrability <= 0.1) return "Solid.";
  if (penetrability === 1) return "No effect.";
  return penetrability < 1 ? `Slows robots to ${penetrability} × their speed.` : `Speeds robots up to ${penetrability} × their speed.`;
}

/** Opens the menu. `fault` is the one in force behind the obstacle, if any. `isOpen`: the run accepts orders. */
export function obstacleMenu(obstacle, fault, orders, isOpen, at) {
  const { x_m, y_m, width_m, height_m } = obstacle;
  const origin = fault
    ? `Created by fault ${fault.id}, in force since ${seconds(fault.applied_ms, 2)}.`
    : "It belongs to the scenario and cannot be removed.";
  const remove = () => (orders.clear(fault.id), closeMenu());
  openMenu(
    `Obstacle, ${meters(width_m)} × ${meters(height_m)}`,
    at,
    el("p", {}, `Lower left corner at ${meters(x_m)}, ${meters(y_m)}. ${effect(obstacle)} ${origin}`),
    fault && isOpen
      ? el(
          "div",
          { class: "choices" },
          el("button", { type: "button", "data-action": "remove", "data-undo": fault.id, onclick: remove }, "Remove"),
        )
      : null,
  );
}
