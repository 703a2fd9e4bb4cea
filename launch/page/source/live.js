// A live run, as the server's socket tells it. When the socket closes the run is over for this page: nothing is tried again,
// for the server lives no longer than its command.

/** Follows the run until its end. */
export function followLive(api, model) {
  const socket = api.live();
  socket.addEventListener("message", ({ data }) => {
    const [[kind, content]] = Object.entries(JSON.parse(data));
    switch (kind) {
      case "past":
        for (const view of content.views) model.absorb(view);
        model.addEvents(content.events);
        break;
      case "view":
        model.absorb(content);
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
  socket.addEventListener("close", () => model.end({ outcome: null, folder: model.run.folder }));
}
