// Follow a rig from JavaScript, over the page's address: the verdict now, every survey from the first on, and the alarms at the end.
//
//   borechain rig wellbore-1 --speed 60 --page 127.0.0.1:8080     # in one shell
//   node examples/follow_a_rig.mjs http://127.0.0.1:8080          # in another; Node.js 20 or later, no package
//
// In a browser `new EventSource("/api/stream")` takes the place of `changes`.

/** Answer of the key ground/PATH; an error says what is wrong with the question, in the ground station's words. */
async function ask(address, path) {
  const response = await fetch(`${address}/api/${path}`);
  const answer = await response.json();
  if (!response.ok) throw new Error(answer.error);
  return answer;
}

/** What changes, as it comes: the name of each path and its newest answer; ends when nothing has come for a time. */
async function* changes(address, silenceMs) {
  const ended = new AbortController();
  const response = await fetch(`${address}/api/stream`, { signal: ended.signal });
  const reader = response.body.pipeThrough(new TextDecoderStream()).getReader();
  let text = "";
  try {
    for (;;) {
      const part = await within(silenceMs, reader.read());
      if (part === undefined || part.done) return;
      const events = (text + part.value).split("\n\n");
      text = events.pop();
      for (const event of events) {
        const data = event.match(/^event: answer\ndata: (.*)$/);
        if (data) yield JSON.parse(data[1]);
      }
    }
  } finally {
    ended.abort();
  }
}

/** What a promise gives, or undefined after a time. */
async function within(ms, promise) {
  let timer;
  const late = new Promise((done) => { timer = setTimeout(done, ms); });
  promise.catch(() => {}); // what comes after the end is ignored
  try {
    return await Promise.race([promise, late]);
  } finally {
    clearTimeout(timer);
  }
}

/** Print what the crew of a rig is told, until nothing has come for a time. */
async function follow(address, silenceS) {
  let since = 0;
  let line = "";
  for await (const { path, answer } of changes(address, 1000 * silenceS)) {
    if (path === "verdict" && answer.line !== line) {
      line = answer.line;
      console.log(line);
    } else if (path === "column") { // it changes with every survey
      const found = await ask(address, `measurements?since=${since}`);
      since = found.newest;
      for (const row of found.measurements) {
        console.log(`tube ${row.tube} at ${row.md_m.toFixed(1)} m: ${row.inclination_deg.toFixed(2)} deg`);
      }
    }
  }
  console.log((await ask(address, "verdict")).line);
  for (const alarm of (await ask(address, "alarms")).open) {
    console.log(`alarm ${alarm.number} ${alarm.state}: ${alarm.code} ${alarm.subject} ${alarm.detail}`);
  }
}

const [address = "http://127.0.0.1:8080", silenceS = "60"] = process.argv.slice(2);
await follow(address, Number(silenceS));
