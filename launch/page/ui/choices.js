// The choices of the user on this page. The run does not receive them.

export class Choices {
  /** The rank of the selected robot, or null. */
  selected = null;
  /** Shows sensor rays. */
  rays = false;
  /** Shows trails. */
  trails = true;
  /** Shows radio links. */
  radio = false;
  /** The pointer tool: look, obstacle, move, or a fault of the mission (see room/fault_tools.js). */
  tool = "look";

  #changed;

  constructor(changed) {
    this.#changed = changed;
  }

  /** Changes choices and redraws the page. */
  set(choice) {
    Object.assign(this, choice);
    this.#changed();
  }

  /** Toggles rays, trails or radio. */
  toggle(name) {
    this.set({ [name]: !this[name] });
  }
}
