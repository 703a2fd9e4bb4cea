// The clock of a live run: what it shows comes with the views, what is asked of it goes to the world.

export class LiveClock {
  #model;
  #orders;
  // What the world answered last, until the next view: {status, view}.
  #answered = null;

  constructor(model, orders) {
    this.#model = model;
    this.#orders = orders;
  }

  get #status() {
    const seen = this.#model.view?.clock ?? { paused: false, speed: null, steps_left: 0, tick: 0 };
    return this.#answered && this.#answered.view === this.#model.view ? this.#answered.status : seen;
  }

  /** Whether no tick begins; while steps are left, some do. */
  get paused() {
    return this.#status.paused && this.#status.steps_left === 0;
  }

  get speed() {
    return this.#status.speed;
  }

  get isWaiting() {
    return false;
  }

  toggle() {
    return this.#ask(this.paused ? "resume" : "pause");
  }

  step(ticks) {
    return this.#ask({ step: ticks });
  }

  setSpeed(speed) {
    return this.#ask({ speed });
  }

  async #ask(command) {
    const status = await this.#orders.clock(command);
    this.#answered = status && { status, view: this.#model.view };
  }
}
