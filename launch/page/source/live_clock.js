// The clock of a live run: views contain its state, orders change it.

export class LiveClock {
  #model;
  #orders;
  // The world's latest reply, valid until the next view: {status, view}.
  #reply = null;

  constructor(model, orders) {
    this.#model = model;
    this.#orders = orders;
  }

  get #status() {
    const shown = this.#model.view?.clock ?? { paused: false, speed: null, steps_left: 0, tick: 0 };
    return this.#reply && this.#reply.view === this.#model.view ? this.#reply.status : shown;
  }

  /** Tests whether the clock is held. With steps left it is not. */
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
    return this.#send(this.paused ? "resume" : "pause");
  }

  step(ticks) {
    return this.#send({ step: ticks });
  }

  setSpeed(speed) {
    return this.#send({ speed });
  }

  async #send(command) {
    const status = await this.#orders.clock(command);
    this.#reply = status && { status, view: this.#model.view };
  }
}
