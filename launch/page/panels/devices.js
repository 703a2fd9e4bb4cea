// The menus of a robot: sensor faults, actuator faults, skill faults and others.

import { devicesOf } from "../model/devices.js";
import { skillsOf } from "../model/skills.js";
import { chosenDuration } from "../room/tools.js";
import { el } from "../ui/dom.js";
import { closeMenu, numberField, openMenu, selectField } from "../ui/menu.js";

const SENSOR_MODES = [
  ["dead", "dead: no readings"],
  ["stuck", "stuck: repeats its last reading"],
  ["noise", "noise"],
  ["bias", "bias"],
  ["dropout", "dropout: some readings are missing"],
];

const ACTUATOR_MODES = [
  ["dead", "drive dead"],
  ["slowed", "drive slowed"],
  ["turn-bias", "turn bias"],
  ["one-wheel left", "left wheel dead"],
  ["one-wheel right", "right wheel dead"],
  ["gripper", "gripper failed"],
];

const durationField = () =>
  numberField("Duration, s", {
    min: 0.05,
    step: "any",
    value: chosenDuration() ?? "",
    placeholder: "until undone",
    "data-field": "for",
  });
const chosenSeconds = ({ input }) => (input.valueAsNumber > 0 ? input.valueAsNumber : null);

/** Creates a form that arms `fault()` for the chosen time. */
function form(orders, button, time, fault, ...fields) {
  const submit = (event) => {
    event.preventDefault();
    closeMenu();
    orders.arm(fault(), chosenSeconds(time));
  };
  return el(
    "form",
    { class: "choices", onsubmit: submit },
    ...fields,
    time.element,
    el("button", { type: "submit", "data-action": "break" }, button),
  );
}

/** Opens the menu of sensor faults. */
export function openSensors(model, orders, rank, at) {
  const robot = model.names[rank];
  const devices = devicesOf(model.run, rank);
  const choice = devices.map(({ name, label }) => [name, label]);
  const device = selectField("Sensor", choice, { "data-field": "device" });
  const mode = selectField("Mode", SENSOR_MODES, { "data-field": "mode" });
  const error = numberField("By, m", { step: "any", value: 0.2, "data-field": "m" });
  const turn = numberField("By, degrees", { step: "any", value: 0, "data-field": "deg" });
  const share = numberField("Share of steps without a reading, %", { min: 0, max: 100, step: 1, value: 25, "data-field": "share" });
  const adapt = () => {
    const { tells_lengths, tells_heading } = devices.find(({ name }) => name === device.input.value);
    for (const option of mode.input.options) option.disabled = !tells_lengths && (option.value === "noise" || option.value === "bias");
    if (mode.input.selectedOptions[0].disabled) mode.input.value = "dead";
    const hasError = mode.input.value === "noise" || mode.input.value === "bias";
    error.element.hidden = !hasError;
    turn.element.hidden = !hasError || !tells_heading;
    share.element.hidden = mode.input.value !== "dropout";
  };
  for (const { input } of [device, mode]) input.addEventListener("change", adapt);
  adapt();
  const chosen = () => {
    const how = mode.input.value;
    if (how === "dropout") return { dropout: share.input.valueAsNumber / 100 };
    if (how !== "noise" && how !== "bias") return how;
    return { [how]: { m: error.input.valueAsNumber || 0, deg: turn.element.hidden ? 0 : turn.input.valueAsNumber || 0 } };
  };
  const fault = () => ({ sensor: { robot, device: device.input.value, mode: chosen() } });
  const fields = [device, mode, error, turn, share].map(({ element }) => element);
  openMenu(`Break a sensor of ${robot}`, at, form(orders, "Break it", durationField(), fault, ...fields));
}

/** Opens the menu of actuator faults. */
export function openActuators(model, orders, rank, at) {
  const robot = model.names[rank];
  const mode = selectField("Mode", ACTUATOR_MODES, { "data-field": "mode" });
  const share = numberField("Remaining share of its speed, %", { min: 0, max: 100, step: 1, value: 20, "data-field": "share" });
  const turn = numberField("By, degrees/s", { step: "any", value: -10, "data-field": "deg" });
  const adapt = () => {
    share.element.hidden = mode.input.value !== "slowed";
    turn.element.hidden = mode.input.value !== "turn-bias";
  };
  mode.input.addEventListener("change", adapt);
  adapt();
  const chosen = () => {
    const [how, side] = mode.input.value.split(" ");
    if (side) return { [how]: side };
    if (how === "slowed") return { slowed: share.input.valueAsNumber / 100 };
    return how === "turn-bias" ? { "turn-bias": turn.input.valueAsNumber } : how;
  };
  const fault = () => ({ actuator: { robot, mode: chosen() } });
  openMenu(
    `Break an actuator of ${robot}`,
    at,
    form(orders, "Break it", durationField(), fault, mode.element, share.element, turn.element),
  );
}

/** Opens the menu of skill faults. */
export function openSkills(model, orders, rank, at) {
  const robot = model.names[rank];
  const choice = skillsOf(model.run, rank).map((name) => [name, name]);
  const skill = selectField("Skill", choice, { "data-field": "skill" });
  const share = numberField("Remaining share, %", { min: 0, max: 100, step: 1, value: 30, "data-field": "share" });
  const fault = () => ({ skill: { robot, skill: skill.input.value, share: share.input.valueAsNumber / 100 } });
  openMenu(`Reduce a skill of ${robot}`, at, form(orders, "Reduce it", durationField(), fault, skill.element, share.element));
}

/** Opens the menu of the other faults: radio, behavior, power, place. */
export function openMore(model, choices, orders, rank, at) {
  const robot = model.names[rank];
  const time = durationField();
  const arm = (name, label) =>
    el(
      "button",
      { type: "button", "data-action": name, onclick: () => (closeMenu(), orders.arm({ [name]: robot }, chosenSeconds(time))) },
      label,
    );
  const move = () => (closeMenu(), choices.set({ selected: rank, tool: "move" }));
  openMenu(
    `More for ${robot}`,
    at,
    el(
      "div",
      { class: "choices" },
      arm("mute", "Mute: its messages do not arrive"),
      arm("deaf", "Deaf: receives no messages"),
      arm("babble", "Babble: reports activity, does nothing"),
      arm("power", "Power off"),
      arm("terminate", "Terminate (SIGTERM)"),
      arm("remove", "Remove from the mission"),
      time.element,
      el("button", { type: "button", "data-action": "move", onclick: move }, "Move it: click in the room"),
    ),
  );
}
