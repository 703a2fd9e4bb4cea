// A live run, as the server's socket tells it. When the socket closes nothing is tried again, for the server lives no longer
// than its command; whether the run is over, it has said before. Where the command goes on with the log, so does the page.

/** Which run this page has shown live, while it goes on to its log. */
const FROM_LIVE = "alliance-from-live";

/** Follows the run until its end. */
export function followLive(api, model) {
  const socket = api.live();
  socket.addEventListener("message", ({ data }) => {
    const [[kind, content]] = Object.entries(JSON.parse(data));
    switch (kind) {
      case "past":
        for (const view of content.views) model.absorb(view);
        model.hear(content.messages);
        model.bend(content.bends);
        model.addEvents(content.events);
        break;
      case "view":
        model.absorb(content);
        break;
      case "messages":
        model.hear(content);
        break;
      case "bends":
        model.bend(content);
        break;
      case "events":
        model.addEvents(content);
        break;
      case "missed":
        model.miss(content);
        break;
      case "ended":
        model.end(content);
        break;
    }
  });
  socket.addEventListener("close", () => {
    model.end({ isServerGone: true });
    if (model.run.stays && !model.ended.isServerGone) goOnToLog(api);
  });
}

/** How often it is looked whether the log is there, ms. */
const RETRY_MS = 300;

/** Shows the log of the run at the same link, as soon as it is there; at its end, which is where the run is now. */
async function goOnToLog(api) {
  const run = await api.get("/api/run").catch(() => null);
  if (run?.mode !== "log") {
    setTimeout(() => goOnToLog(api), RETRY_MS);
    return;
  }
  sessionStorage.setItem(FROM_LIVE, run.run);
  location.reload();
}

/** Whether this page has just shown that run live; says so once. */
export function wasLive(run) {
  const was = sessionStorage.getItem(FROM_LIVE) === run.run;
  sessionStorage.removeItem(FROM_LIVE);
  return was;
}
