// Runs a plan in the module of the playground, in Node.js and in a browser. `Program` is the class of
// launch/page/source/worker.js.

/** The number of ticks after which any run is over. */
const ENDLESS = 1e9;

/**
 * Returns the result of each run of a plan: `{hash, beside, replies, ticks}`. A run has a `choice` and `orders`, each a tick
 * and a command, by tick. `beside` is the hash of the second run, or null.
 */
export async function results(bytes, Program, plan) {
  const found = [];
  for (const { choice, orders } of plan) {
    const program = await Program.load(bytes);
    program.list();
    program.open(choice, 0);
    let tick = 0;
    const step = (ticks) => {
      if (ticks === 0) return;
      program.control({ clock: { step: ticks } }, 0);
      while (program.advance(0, 1000) !== Infinity);
      tick += ticks;
    };
    program.control({ clock: { speed: null } }, 0);
    const replies = [];
    for (const [at, command] of orders) {
      step(at - tick);
      replies.push(program.control(command, 0));
    }
    step(ENDLESS);
    const frames = program.frames();
    const view = frames.find((frame) => frame.startsWith('{"view"'));
    const second = frames.find((frame) => frame.startsWith('+{"hash"'));
    const beside = second ? JSON.parse(second.slice(1)).hash : null;
    found.push({ hash: program.hash(), beside, replies, ticks: JSON.parse(view).view.tick });
  }
  return found;
}
