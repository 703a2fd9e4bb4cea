// The menu that arms any fault, from the declarations of the run.

import { chosenDuration } from "../room/tools.js";
import { el } from "../ui/dom.js";
import { closeMenu, numberField, openMenu, selectField, textField } from "../ui/menu.js";
import { groupsIn, label, modeOf, ownFault } from "../model/own_faults.js";

const named = (name) => [name, name];

/** Creates the controls of an argument: `{elements, value}`. The value of an empty number is NaN, which selects the default. */
function controls({ key, label: words, unit, about, form, from, to, is_whole, is_required, default: value, names, modes }) {
  const attributes = { "data-field": key, title: about };
  const single = ({ element, input }, valueOf) => ({ elements: [element], value: () => valueOf(input) });
  switch (form) {
    case "name":
      return single(selectField(words, names.map(named), attributes), (input) => input.value);
    case "flag":
      return single(selectField(words, value === 1 ? [named("yes"), named("no")] : [named("no"), named("yes")], attributes), (input) => input.value === "yes");
    case "groups": {
      const options = { ...attributes, required: true, placeholder: "blue,gold / green" };
      return single(textField(words, options), (input) => groupsIn(input.value));
    }
    case "mode":
      return modeControls(words, modes, attributes);
    default: {
      const options = { ...attributes, min: from, max: to, step: is_whole ? 1 : "any", value: value ?? "", required: is_required };
      return single(numberField(unit ? `${words}, ${unit}` : words, options), (input) => input.valueAsNumber);
    }
  }
}

/** Creates the controls of a mode and of its size. */
function modeControls(words, modes, attributes) {
  const choice = selectField(words, modes.map(({ name }) => named(name)), attributes);
  const sizes = el("div", { class: "choices" });
  const required = { step: "any", required: true, "data-field": "size" };
  let mode, size, deg;
  const adapt = () => {
    mode = modes.find(({ name }) => name === choice.input.value);
    size = mode.words && selectField("size", mode.words.map(named), { "data-field": "size" });
    if (mode.from !== null) size = numberField("size", { min: mode.from, max: mode.to, ...required });
    deg = mode.takes_deg && numberField("heading, degrees", { step: "any", "data-field": "deg" });
    sizes.replaceChildren(...[size, deg].filter(Boolean).map(({ element }) => element));
  };
  choice.input.addEventListener("change", adapt);
  adapt();
  const sizeOf = ({ input }) => (input.localName === "select" ? input.value : input.valueAsNumber);
  const value = () => modeOf(mode, size && sizeOf(size), deg && deg.input.valueAsNumber);
  return { elements: [choice.element, sizes], value };
}

/** Returns the fault with these values by key, in the form of files: a single name replaces the table. */
function faultOf(kind, values) {
  const [first, ...others] = kind.arguments;
  if (others.length === 0 && first.form === "name") return { [kind.name]: values[first.key] };
  return ownFault({ name: kind.name, place: null }, values, null);
}

/** Opens the menu next to `at`. */
export function openNewFault(run, orders, at) {
  const kinds = run.faults;
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
  let kind, fields;
  const adapt = () => {
    kind = kinds.find(({ name }) => name === choice.input.value);
    fields = kind.arguments.map((argument) => ({ key: argument.key, ...controls(argument) }));
    about.textContent = kind.about;
    duration.element.hidden = run.momentary.includes(kind.name);
    rows.replaceChildren(...fields.flatMap(({ elements }) => elements));
  };
  choice.input.addEventListener("change", adapt);
  adapt();
  const submit = (event) => {
    event.preventDefault();
    const values = Object.fromEntries(fields.map(({ key, value }) => [key, value()]));
    const for_s = duration.input.valueAsNumber;
    closeMenu();
    orders.arm(faultOf(kind, values), for_s > 0 ? for_s : null);
  };
  const arm = el("button", { type: "submit", "data-action": "arm" }, "Arm it");
  const form = el("form", { class: "choices", onsubmit: submit }, choice.element, about, rows, duration.element, arm);
  openMenu("New fault", at, form);
}
