// A live run over the server's socket. A closed socket is not reopened, because the server runs only as long as its
// command. An end of the run is reported before. If the command continues with the log, so does the page.

/** The session key of the run that this page showed live, until it shows the log. */
const FROM_LIVE = "alliance-from-live";

/** Follows the run to its end. */
export function followLive(api, model) {
  const socket = api.openLiveSocket();
  socket.addEventListener("message", ({ data }) => {
    const [[kind, content]] = Object.entries(JSON.parse(data));
    switch (kind) {
      case "past":
        for (const view of content.views) model.addView(view);
        model.addMessages(content.messages);
        model.addCorners(content.corners);
        model.addEvents(content.events);
        break;
      case "view":
        model.addView(content);
        break;
      case "messages":
        model.addMessages(content);
        break;
      case "corners":
        model.addCorners(content);
        break;
      case "events":
        model.addEvents(content);
        break;
      case "hash":
        model.setHash(content);
        break;
      case "broadcasts":
        model.setBroadcasts(content);
        break;
      case "missed":
        model.addMissed(content);
        break;
      case "ended":
        model.setEnded(content);
        break;
      case "stopped":
        model.setEnded({ stopped: content });
        break;
    }
  });
  socket.addEventListener("close", () => {
    model.setEnded({ isDisconnected: true });
    if (model.run.stays && !model.ended.isDisconnected) openLog(api);
  });
}

/** The time between two checks for the log, ms. */
const RETRY_MS = 300;

/** Opens the log of the run at the same link as soon as it exists. */
async function openLog(api) {
  const run = await api.run().catch(() => null);
  if (run?.mode !== "log") {
    setTimeout(() => openLog(api), RETRY_MS);
    return;
  }
  sessionStorage.setItem(FROM_LIVE, run.run);
  location.reload();
}

/** Returns whether this page has just shown that run live. Returns true only once. */
export function wasLive(run) {
  const was = sessionStorage.getItem(FROM_LIVE) === run.run;
  sessionStorage.removeItem(FROM_LIVE);
  return was;
}
