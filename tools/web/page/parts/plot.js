// Lines over time: large ones with axes, and small ones in tables. Styles have the colours and patterns; lines are drawn in a
// field of 100 x 100 that is stretched, and labels are texts beside it.
import { drawing, element, replace, setAttribute, setText } from '../dom.js';
import { isKnown, pathOf, rangeOf, ticks, timeTicks } from '../lines.js';
import { number, words } from '../words.js';
import { clock } from '../time.js';

/** A mouse drag that is shorter, in pixels, is a click. */
const leastZoom = 8;
const labelsInHeight = 4;
/** The width of a time and the space around it, in em. */
const labelWidth = 6;

/** A line as text, for screen readers. */
function inWords(title, values) {
  const known = values.filter(isKnown);
  if (known.length === 0) {
    return `${title}: ${words.services.noPlot}`;
  }
  return words.services.plotSays(title, number(known.at(-1), 2), number(Math.min(...known), 2), number(Math.max(...known), 2));
}

/**
 * A plot of one or two lines; { node, area, update(times, lines, between) }: times in milliseconds, lines an array of values
 * for each label, null for missing values; `between` the first and the last time shown. With `step` a value holds until the
 * next; `side` replaces the legend; `names` are names for the values 0, 1, 2 …; `zoomed(from, to)` is called with the time
 * that a reader has selected with the mouse.
 */
export function plot(title, labels, { step = false, side = null, names = null, zoomed = null } = {}) {
  const grid = drawing('path', { class: 'plot-grid' });
  const paths = labels.map((_, i) => drawing('path', { class: 'plot-line', 'data-line': i + 1 }));
  const svg = drawing('svg', { viewBox: '0 0 100 100', preserveAspectRatio: 'none' }, grid, paths);
  const marks = element('div');
  const field = element('div', { class: 'plot-field' }, svg, marks);
  const area = element('div', { class: 'plot-area', 'aria-hidden': 'true' }, field);
  const says = element('p', { class: 'for-readers' });
  const legend = side ?? element('span', { class: 'plot-legend', 'aria-hidden': 'true' }, labels.map((label, i) => element('span', {},
    drawing('svg', { viewBox: '0 0 24 6', class: 'plot-key' }, drawing('path', { class: 'plot-line', 'data-line': i + 1, d: 'M0 3h24' })), label)));
  const node = element('figure', { class: 'plot' }, element('figcaption', {}, title, legend), area, says);
  let shown = null;
  if (zoomed) {
    selectTime(field, (share) => shown[0] + share * (shown[1] - shown[0]), zoomed);
  }

  /** A label at a share of the width, or of the height from below. */
  const mark = (className, edge, place, label) => {
    const made = element('span', { class: className }, label);
    made.style[edge] = `${place}%`;
    return made;
  };
  return {
    node,
    area,
    update(times, lines, between = null) {
      setText(says, lines.map((line, i) => inWords(`${title}, ${labels[i]}`, line)).join('. '));
      shown = between ?? [times[0], times.at(-1)];
      const [from, to] = shown;
      const [low, high] = names ? [-0.3, names.length - 0.7] : rangeOf(lines.flat(), !step);
      const x = (time) => (100 * (time - from)) / (to - from || 1);
      const y = (value) => 100 - (100 * (value - low)) / (high - low);
      const values = names ? names.map((label, value) => [value, label]) : ticks(low, high, labelsInHeight).map((value) => [value, number(value, 2)]);
      // Without a width the plot is not on the page yet.
      const width = field.clientWidth / Number.parseFloat(getComputedStyle(field).fontSize) || 10 * labelWidth;
      const moments = timeTicks(from, to, Math.max(2, width / labelWidth));
      setAttribute(grid, 'd', values.map(([value]) => `M0 ${y(value)}H100`).join('') + moments.map((time) => `M${x(time)} 0V100`).join(''));
      lines.forEach((line, i) => setAttribute(paths[i], 'd', pathOf(line, (at) => x(times[at]), y, step)));
      replace(marks, values.map(([value, label]) => mark('plot-y', 'top', y(value), label)),
        moments.filter((time) => (100 - x(time)) * width > 200).map((time) => mark('plot-x', 'left', x(time), clock(time).replace(/:00$/, ''))));
    },
  };
}

/** Calls `selected(from, to)` with the times that a reader draws over with the mouse; `timeAt` has the time at a share of the width. */
function selectTime(field, timeAt, selected) {
  const veil = element('div', { class: 'plot-veil', hidden: true });
  let from = null;
  const range = (event) => {
    const { left, width } = field.getBoundingClientRect();
    return [from, event.clientX].map((x) => Math.min(1, Math.max(0, (x - left) / width))).sort((a, b) => a - b);
  };
  field.append(veil);
  field.addEventListener('pointerdown', (event) => {
    if (event.button === 0 && event.pointerType === 'mouse') {
      from = event.clientX;
      field.setPointerCapture(event.pointerId);
    }
  });
  field.addEventListener('pointermove', (event) => {
    if (from !== null) {
      const [left, right] = range(event);
      veil.hidden = false;
      veil.style.left = `${100 * left}%`;
      veil.style.width = `${100 * (right - left)}%`;
    }
  });
  field.addEventListener('pointerup', (event) => {
    if (from === null) {
      return;
    }
    const [left, right] = range(event);
    from = null;
    veil.hidden = true;
    if ((right - left) * field.clientWidth >= leastZoom) {
      selected(timeAt(left), timeAt(right));
    }
  });
}

/** A line in a table cell, without axes; { node, update(values) }. */
export function sparkline(title) {
  const path = drawing('path', { class: 'spark-line', d: '' });
  const node = drawing('svg', { class: 'spark', viewBox: '0 0 100 24', preserveAspectRatio: 'none', role: 'img' }, path);
  return {
    node,
    update(values) {
      const top = Math.max(...values.filter(isKnown), 1e-9);
      setAttribute(path, 'd', pathOf(values, (i) => (100 * i) / Math.max(values.length - 1, 1), (value) => 22 - (20 * value) / top));
      setAttribute(node, 'aria-label', inWords(title, values));
    },
  };
}
