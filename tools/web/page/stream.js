// The live connection to the server: server-sent events, begun anew whenever they stop.
//
//   listen({ snapshot, changes, lost, bye });

/** The server says something every two seconds at least. */
const silenceMs = 5000;
/** A connection that breaks and is there again within this time is not worth a word. */
const graceMs = 1500;
const retryMs = [500, 1000, 2000, 3000];

/** Calls `on.snapshot`, `on.changes` and `on.bye` with what comes, and `on.lost` when nothing comes any more. */
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
      // The browser's own way to try again gives up at an answer that is none; ours does not.
      source.close();
      clearTimeout(silence);
      grace ||= setTimeout(on.lost, graceMs);
      silence = setTimeout(open, retryMs[Math.min(tries, retryMs.length - 1)]);
      tries += 1;
    });
  };
  open();
}
