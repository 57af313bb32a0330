// Lines over time: large ones by dygraphs, which is loaded with the first of them, and small ones in tables.
import { drawing, element, setAttribute, setText } from '../dom.js';
import { number, words } from '../words.js';
import { clock } from '../time.js';

let library = null;

function load() {
  library ??= new Promise((resolve, reject) => {
    document.head.append(element('script', {
      src: '/lib/dygraph.min.js', onload: () => resolve(withoutLegend(globalThis.Dygraph)), onerror: () => reject(new Error('dygraph.min.js')),
    }));
  });
  return library;
}

/** Disables the legend of dygraphs: it needs style attributes, which the page's policy forbids. The page has its own. */
function withoutLegend(Dygraph) {
  Dygraph.PLUGINS = Dygraph.PLUGINS.filter((plugin) => plugin !== Dygraph.Plugins.Legend);
  return Dygraph;
}

const colour = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();
/** A mouse drag that is shorter, in pixels, is a click. */
const leastZoom = 8;
const lineColours = ['--line-1', '--line-2'];
/** The second line is dashed, so that the lines differ without colours. */
const patterns = [null, [6, 4]];

/** On a wall letters are larger. */
const timeAxis = () => (document.documentElement.classList.contains('wall') ? { pixelsPerLabel: 130, axisLabelWidth: 110 } : { pixelsPerLabel: 75, axisLabelWidth: 60 });

/** A line as text, for screen readers. */
function inWords(title, values) {
  const known = values.filter((value) => value !== null && value !== undefined);
  if (known.length === 0) {
    return `${title}: ${words.services.noPlot}`;
  }
  return words.services.plotSays(title, number(known.at(-1), 2), number(Math.min(...known), 2), number(Math.max(...known), 2));
}

/**
 * A plot of one or two lines; { node, area, update(times, lines, between), redraw }: times in milliseconds, lines an array
 * of values for each label, null for missing values; `between` the first and the last time shown. With `step` a value holds
 * until the next; `side` replaces the legend; `names` are names for the values 0, 1, 2 …; `zoomed(from, to)` is called with
 * the time that a reader has selected with the mouse.
 */
export function plot(title, labels, { step = false, side = null, names = null, zoomed = null } = {}) {
  const area = element('div', { class: 'plot-area', 'aria-hidden': 'true' });
  const says = element('p', { class: 'for-readers' });
  const legend = side ?? element('span', { class: 'plot-legend', 'aria-hidden': 'true' }, labels.map((label, i) => element('span', { 'data-line': i + 1 },
    drawing('svg', { viewBox: '0 0 24 6', class: 'plot-key' }, drawing('path', { d: i === 0 ? 'M0 3h24' : 'M0 3h7M10 3h7M20 3h4' })), label)));
  const node = element('figure', { class: 'plot' }, element('figcaption', {}, title, legend), area, says);
  let graph = null;
  let wanted = null;
  let shown = null;

  const options = () => ({
    dateWindow: shown,
    colors: lineColours.map(colour).slice(0, labels.length),
    gridLineColor: colour('--grid'),
    axisLineColor: colour('--grid'),
  });
  if (zoomed) {
    const veil = element('div', { class: 'plot-veil', hidden: true });
    let from = null;
    const range = (event) => [from, event.clientX].sort((a, b) => a - b).map((x) => x - area.getBoundingClientRect().left);
    area.addEventListener('pointerdown', (event) => {
      if (graph !== null && event.button === 0 && event.pointerType === 'mouse') {
        from = event.clientX;
        area.append(veil);
        area.setPointerCapture(event.pointerId);
      }
    });
    area.addEventListener('pointermove', (event) => {
      if (from !== null) {
        const [left, right] = range(event);
        veil.hidden = false;
        veil.style.left = `${left}px`;
        veil.style.width = `${right - left}px`;
      }
    });
    area.addEventListener('pointerup', (event) => {
      if (from === null) {
        return;
      }
      const [left, right] = range(event);
      from = null;
      veil.hidden = true;
      if (right - left >= leastZoom) {
        zoomed(graph.toDataXCoord(left), graph.toDataXCoord(right));
      }
    });
  }
  const draw = async () => {
    const Dygraph = await load();
    if (!node.isConnected || wanted === null || wanted.length === 0) {
      return;
    }
    if (graph !== null) {
      graph.updateOptions({ file: wanted, ...options() });
      return;
    }
    graph = new Dygraph(area, wanted, {
      labels: [words.services.plotLabels.time, ...labels],
      series: Object.fromEntries(labels.map((label, i) => [label, { strokePattern: patterns[i] }])),
      strokeWidth: 1.8,
      includeZero: !step && !names,
      valueRange: names && [-0.3, names.length - 0.7],
      stepPlot: step,
      drawPoints: !step,
      drawPointCallback: alonePoint,
      pointSize: 2,
      highlightCircleSize: 0,
      legend: 'never',
      interactionModel: {},
      rightGap: 8,
      axes: {
        x: { axisLabelFormatter: (time) => clock(Number(time)).replace(/:00$/, ''), ...timeAxis() },
        y: { ...(names ? { ticker: () => names.map((label, v) => ({ v, label })) } : { axisLabelFormatter: (value) => number(value, 2) }), axisLabelWidth: step ? 76 : 40, pixelsPerLabel: 26 },
      },
      ...options(),
    });
  };
  const redraw = () => draw().catch(() => setText(area, words.failure.unreachable));
  return {
    node,
    area,
    redraw,
    update(times, lines, between = null) {
      shown = between;
      wanted = times.map((time, i) => [new Date(time), ...lines.map((line) => line[i] ?? null)]);
      setText(says, lines.map((line, i) => inWords(`${title}, ${labels[i]}`, line)).join('. '));
      redraw();
    },
  };
}

/** A single value between two missing ones would be no line. */
function alonePoint(graph, series, context, x, y, fill, radius) {
  context.beginPath();
  context.fillStyle = fill;
  context.arc(x, y, Math.min(radius, 1.2), 0, 2 * Math.PI);
  context.fill();
}

/** A line in a table cell, without axes; { node, update(values) }. */
export function sparkline(title) {
  const path = drawing('path', { class: 'spark-line', d: '' });
  const node = drawing('svg', { class: 'spark', viewBox: '0 0 100 24', preserveAspectRatio: 'none', role: 'img' }, path);
  return {
    node,
    update(values) {
      const known = values.filter((value) => value !== null && value !== undefined);
      const top = Math.max(...known, 1e-9);
      const step = 100 / Math.max(values.length - 1, 1);
      let pen = 'M';
      const d = values.map((value, i) => {
        if (value === null || value === undefined) {
          pen = 'M';
          return '';
        }
        const point = `${pen}${(i * step).toFixed(1)} ${(22 - (20 * value) / top).toFixed(1)}`;
        pen = 'L';
        return point;
      }).join('');
      setAttribute(path, 'd', d);
      setAttribute(node, 'aria-label', inWords(title, values));
    },
  };
}
