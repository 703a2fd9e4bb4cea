// A live run, as the server's socket tells it. When the socket closes nothing is tried again, for the server lives no longer
// than its command; whether the run is over, it has said before.

/** Follows the run until its end. */
export function followLive(api, model) {
  const socket = api.live();
  socket.addEventListener("message", ({ data }) => {
    const [[kind, content]] = Object.entries(JSON.parse(data));
    switch (kind) {
      case "past":
        for (const view of content.views) model.absorb(view);
        model.hear(content.messages);
        model.addEvents(content.events);
        break;
      case "view":
        model.absorb(content);
        break;
      case "messages":
        model.hear(content);
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
  socket.addEventListener("close", () => model.end({ isServerGone: true }));
}
