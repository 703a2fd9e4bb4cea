// What the person has chosen to see and to do; nothing of it is known to the run.

export class Choices {
  /** Rank of the robot that is looked at, or null. */
  selected = null;
  /** Sensor rays on the floor. */
  rays = false;
  /** Where the robots came along. */
  trails = true;
  /** Who hears whom, as lines on the floor. */
  radio = false;
  /** What the pointer does in the room: look, obstacle, move, or a fault of the mission (see room/fault_tools.js). */
  tool = "look";

  #changed;

  constructor(changed) {
    this.#changed = changed;
  }

  /** Chooses, and has the page drawn anew. */
  set(choice) {
    Object.assign(this, choice);
    this.#changed();
  }

  /** Turns one of rays, trails and radio on or off. */
  toggle(name) {
    this.set({ [name]: !this[name] });
  }
}
