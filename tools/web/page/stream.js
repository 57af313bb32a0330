// The live connection to the server: server-sent events, with a new connection whenever one ends.
//
//   listen({ snapshot, changes, lost, bye });

/** The server sends an event at least every two seconds. */
const silenceMs = 5000;
/** A shorter interruption is not shown. */
const graceMs = 1500;
const retryMs = [500, 1000, 2000, 3000];

/** Calls `on.snapshot`, `on.changes` and `on.bye` with the events, and `on.lost` after a silence. */
export function listen(on) {
  let source = null;
  let tries = 0;
  let silence = 0;
  let grace = 0;

  const heard = () => {
    clearTimeout(grace);
    grace = 0;
    clearTimeout(silence);
    silence = setTimeout(again, silenceMs);
  };
  const again = () => {
    on.lost();
    open();
  };
  const take = (use) => (event) => {
    heard();
    use(JSON.parse(event.data));
  };
  const open = () => {
    source?.close();
    clearTimeout(silence);
    silence = setTimeout(again, silenceMs);
    source = new EventSource('/api/live');
    source.addEventListener('snapshot', take((data) => {
      tries = 0;
      on.snapshot(data);
    }));
    source.addEventListener('changes', take(on.changes));
    source.addEventListener('bye', take((data) => on.bye(data)));
    source.addEventListener('error', () => {
      // EventSource stops its own retries after an invalid response; listen() retries always.
      source.close();
      clearTimeout(silence);
      grace ||= setTimeout(on.lost, graceMs);
      silence = setTimeout(open, retryMs[Math.min(tries, retryMs.length - 1)]);
      tries += 1;
    });
  };
  open();
}
