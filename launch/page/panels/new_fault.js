// The menu that arms any fault whose arguments are names and numbers, from the declarations of the run.

import { chosenDuration } from "../room/tools.js";
import { el } from "../ui/dom.js";
import { closeMenu, numberField, openMenu, selectField } from "../ui/menu.js";
import { label, ownFault } from "../model/own_faults.js";

const isField = ({ names, from }) => names !== null || from !== null;

/** Creates the field of an argument. An empty field selects the default. */
function field({ key, label: words, unit, about, from, to, is_whole, default: value, option, names }) {
  if (names) return selectField(words, names.map((name) => [name, name]), { "data-field": key, title: about });
  const options = { min: from, max: to, step: is_whole ? 1 : "any", value: value ?? "", required: value === null && option === null };
  return numberField(unit ? `${words}, ${unit}` : words, { ...options, "data-field": key, title: about });
}

/** Returns the fault with these values by key, in the form of files: a single name replaces the table. */
function faultOf(kind, values) {
  const [first, ...others] = kind.arguments;
  if (others.length === 0 && first.names) return { [kind.name]: values[first.key] };
  return ownFault({ name: kind.name, place: null }, values, null);
}

/** Opens the menu next to `at`. */
export function openNewFault(run, orders, at) {
  const kinds = run.faults.filter((kind) => kind.arguments.every(isField));
  const choice = selectField("Fault", kinds.map((kind) => [kind.name, label(kind)]), { "data-field": "kind" });
  const about = el("p", { class: "dim" });
  const rows = el("div", { class: "choices" });
  const duration = numberField("Duration, s", {
    min: 0.05,
    step: "any",
    value: chosenDuration() ?? "",
    placeholder: "until undone",
    "data-field": "for",
  });
  let fields = [];
  const adapt = () => {
    const kind = kinds.find(({ name }) => name === choice.input.value);
    fields = kind.arguments.map((argument) => [argument.key, field(argument)]);
    about.textContent = kind.about;
    duration.element.hidden = run.momentary.includes(kind.name);
    rows.replaceChildren(...fields.map(([, { element }]) => element));
  };
  choice.input.addEventListener("change", adapt);
  adapt();
  const submit = (event) => {
    event.preventDefault();
    const kind = kinds.find(({ name }) => name === choice.input.value);
    const valueOf = (input) => (input.localName === "select" ? input.value : input.valueAsNumber);
    const values = Object.fromEntries(fields.map(([key, { input }]) => [key, valueOf(input)]));
    const for_s = duration.input.valueAsNumber;
    closeMenu();
    orders.arm(faultOf(kind, values), for_s > 0 ? for_s : null);
  };
  const arm = el("button", { type: "submit", "data-action": "arm" }, "Arm it");
  const form = el("form", { class: "choices", onsubmit: submit }, choice.element, about, rows, duration.element, arm);
  openMenu("New fault", at, form);
}
