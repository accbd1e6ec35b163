// The stream of answers: joined, and joined again for as long as the page is open.

const AGAIN_MS = 1500;
const SILENT_MS = 10000; // a verdict comes every second: a stream that is silent for longer is a dead one

/** Follow the ground station; `heard` takes (kind, content), `joined` whether the stream stands. */
export function follow(heard, joined) {
  let source = null;
  let heardAt = performance.now();

  function open() {
    source?.close();
    heardAt = performance.now();
    source = new EventSource("/api/stream");
    for (const kind of ["hello", "answer"]) {
      source.addEventListener(kind, (message) => {
        heardAt = performance.now();
        heard(kind, JSON.parse(message.data));
      });
    }
    source.onopen = () => joined(true);
    source.onerror = () => {
      joined(false);
      source.close();
      setTimeout(open, AGAIN_MS);
    };
  }

  setInterval(() => {
    if (performance.now() - heardAt > SILENT_MS) open();
  }, SILENT_MS / 2);
  open();
  return { reopen: open };
}
