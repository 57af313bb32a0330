// A shape for each state, so that states differ without colours. Each fills 24 × 24 and has the colour of the surrounding
// text.
import { drawing } from './dom.js';

// [outline, mark]; the mark in a filled outline has the colour `--on-shape`.
const shapes = {
  // A ring: nothing to do.
  idle: { ring: 'M12 4a8 8 0 1 1 0 16a8 8 0 1 1 0-16z' },
  // A disc with a triangle: in progress.
  running: { solid: 'M12 2a10 10 0 1 1 0 20a10 10 0 1 1 0-20z', mark: 'M9.5 7.2v9.6l7.6-4.8z' },
  // A disc with an arrow back.
  answering: { solid: 'M12 2a10 10 0 1 1 0 20a10 10 0 1 1 0-20z', mark: 'M12.5 6.5L7 12l5.5 5.5v-3.7H17v-3.6h-4.500z' },
  // An hourglass.
  waiting: { solid: 'M5 2h14v3.500L14 12l5 6.500V22H5v-3.500L10 12L5 5.500z' },
  // A diamond with a question mark: unknown service.
  unserved: {
    solid: 'M12 .8L23.200 12L12 23.200L.8 12z',
    mark: 'M8.800 9.300c0-2 1.400-3.300 3.300-3.300s3.300 1.200 3.300 3c0 1.300-.7 2-1.600 2.700c-.7.5-.8.8-.8 1.700h-2c0-1.600.4-2.300 1.500-3.100c.7-.5.9-.7.9-1.200c0-.7-.5-1.100-1.200-1.100c-.8 0-1.300.5-1.300 1.300zM11 14.800h2.100v2.200H11z',
  },
  // A stop sign with two bars: an operator decides.
  held: {
    solid: 'M7.600 1.500h8.800l6.100 6.100v8.800l-6.100 6.100H7.600l-6.100-6.100V7.600z',
    mark: 'M8 7h2.900v10H8zM13.100 7H16v10h-2.900z',
  },
  // A square with a cross: disconnected.
  down: {
    solid: 'M2.500 2.500h19v19h-19z',
    mark: 'M7.600 5.900L12 10.300l4.400-4.400l1.700 1.700L13.700 12l4.400 4.400l-1.700 1.700L12 13.700l-4.400 4.400l-1.700-1.700L10.300 12L5.900 7.600z',
  },
  // A triangle with an exclamation mark: to be watched.
  look: { solid: 'M12 1.500L23.500 21.500H.5z', mark: 'M10.900 8.500h2.200v6.500h-2.200zM10.900 16.500h2.200v2.200h-2.200z' },
  // A disc with a tick.
  well: {
    solid: 'M12 1.500a10.500 10.500 0 1 1 0 21a10.500 10.500 0 1 1 0-21z',
    mark: 'M10.400 17.300L5.700 12.600l1.900-1.900l2.800 2.800l6.100-6.100l1.900 1.900z',
  },
  // A triangle, and two bars: an NC program runs, or is on hold.
  play: { solid: 'M6 3.500v17L20.500 12z' },
  paused: { solid: 'M5 3.500h5v17H5zM14 3.500h5v17h-5z' },
  // A broken ring: unknown.
  unknown: {
    ring: 'M8.100 5A8 8 0 0 1 16 5M19 8.100A8 8 0 0 1 19 15.900M16 19A8 8 0 0 1 8.100 19M5 15.900A8 8 0 0 1 5 8.100',
  },
  // An arrow out of a door: ends and accepts nothing new.
  draining: { solid: 'M3 3h10v3H6v12h7v3H3zM15 6.500L21.500 12L15 17.500v-4H9v-3h6z' },
};

/** The drawing of a shape, hidden from screen readers: it always has a word beside it. */
export function shape(name) {
  const parts = shapes[name] ?? shapes.unknown;
  return drawing('svg', { viewBox: '0 0 24 24', class: 'shape', 'data-shape': name, 'aria-hidden': 'true', focusable: 'false' },
    parts.ring && drawing('path', { d: parts.ring, class: 'shape-ring' }),
    parts.solid && drawing('path', { d: parts.solid, class: 'shape-solid' }),
    parts.mark && drawing('path', { d: parts.mark, class: 'shape-mark' }));
}
