// The live connection to the server: server-sent events, with a new connection whenever one ends.
//
//   listen({ snapshot, changes, lost, bye });
//
// A browser has six connections to a server (HTTP/1.1), and this one never ends: the tabs of a browser share it.

/** The server sends an event at least every two seconds. */
const silenceMs = 5000;
/** A shorter interruption is not shown. */
const graceMs = 1500;
const retryMs = [500, 1000, 2000, 3000];

/** Calls `tell` with the name of each event and its JSON, and with "lost" after a silence. `open` begins with a snapshot. */
export function connect(tell) {
  let source = null;
  let tries = 0;
  let silence = 0;
  let grace = 0;

  const after = (ms, act) => {
    clearTimeout(silence);
    silence = setTimeout(act, ms);
  };
  const again = () => {
    tell('lost');
    start();
  };
  const close = () => {
    source?.close();
    clearTimeout(silence);
    clearTimeout(grace);
    grace = 0;
  };
  const start = () => {
    source?.close();
    after(silenceMs, again);
    source = new EventSource('/api/live');
    for (const name of ['snapshot', 'changes', 'bye']) {
      source.addEventListener(name, ({ data }) => {
        clearTimeout(grace);
        grace = 0;
        after(silenceMs, again);
        tries *= name !== 'snapshot';
        tell(name, data);
      });
    }
    source.addEventListener('error', () => {
      // EventSource stops its own retries after an invalid response; connect() retries always.
      source.close();
      grace ||= setTimeout(tell, graceMs, 'lost');
      after(retryMs[Math.min(tries, retryMs.length - 1)], start);
      tries += 1;
    });
  };
  return {
    open() {
      close();
      start();
    },
    close,
  };
}

/** Calls `on.snapshot`, `on.changes` and `on.bye` with the events, and `on.lost` after a silence. */
export function listen(on) {
  const take = (name, text) => on[name](text && JSON.parse(text));
  // Chromium for Android has no SharedWorker; there only the visible tab has a connection.
  const alone = () => {
    const { open, close } = connect(take);
    const choose = () => {
      if (document.hidden) {
        close();
        take('lost');
      } else {
        open();
      }
    };
    document.addEventListener('visibilitychange', choose);
    choose();
  };
  if (!globalThis.SharedWorker) {
    alone();
    return;
  }
  const worker = new SharedWorker('/shared_stream.js', { type: 'module' });
  worker.onerror = alone;
  worker.port.onmessage = ({ data }) => take(...data);
  const enter = () => worker.port.postMessage(true);
  const leave = () => worker.port.postMessage(false);
  enter();
  addEventListener('pagehide', leave);
  addEventListener('pageshow', ({ persisted }) => persisted && enter());
  // A frozen tab would only collect events.
  document.addEventListener('freeze', leave);
  document.addEventListener('resume', enter);
}
