// The waterfall of a call: a lane for the gateway and one for each attempt, on one time axis; below, a table of all steps,
// as `millrace calls` prints them.
import { element, visible } from '../dom.js';
import { duration, fineClock, milliseconds } from '../time.js';
import { messageOf } from '../texts/sentences.js';
import { layOut, marksOf, scaleOf } from '../waterfall.js';
import { words } from '../words.js';
import { copyButton, explained, inReadersLanguage, scrolling, tableHead } from './marks.js';

const text = words.call;
/** Narrower bars, as a share of the width, have no text; the legend has it. */
const roomForWords = 0.14;

function place(node, left, right) {
  node.style.left = `${100 * left}%`;
  if (right !== undefined) {
    node.style.width = `${100 * (right - left)}%`;
  }
  return node;
}

function barNode(bar, scale) {
  const took = duration(bar.to - bar.from);
  const name = text.parts[bar.part];
  const [left, right] = [scale.at(bar.from), scale.at(bar.to)];
  const node = element('div', { class: 'bar', 'data-part': bar.part, 'data-broken': scale.broken(bar), title: `${name}: ${took}` },
    right - left > roomForWords && element('span', {}, scale.broken(bar) ? took : `${name} ${took}`));
  return place(node, left, right);
}

function laneNode(lane, scale, nameOf) {
  const title = lane.number === 0 ? text.gatewayLane : text.attemptLane(lane.number);
  const who = lane.instance ? nameOf(lane.instance) : '';
  return element('div', { class: 'lane', 'data-attempt': lane.number },
    element('div', { class: 'lane-title' }, element('strong', {}, title), who && element('span', {}, who)),
    element('div', { class: 'lane-bars' },
      lane.bars.map((bar) => barNode(bar, scale)),
      lane.marks.map((mark) => place(element('i', { class: 'lane-mark', 'data-hop': mark.hop, title: text.hops[mark.hop] }), scale.at(mark.at)))));
}

function axis(scale, start) {
  return element('div', { class: 'axis' }, element('div', { class: 'lane-title' }), element('div', { class: 'lane-bars' },
    marksOf(scale, start).map(({ place: left, after, isMore }) => place(element('span', { class: 'axis-tick', 'data-more': isMore }, after === 0 ? '0' : `${isMore ? '+' : ''}${duration(after)}`), left))));
}

/** The meaning of each kind of bar, and the total duration of each kind. */
function legend(lanes) {
  const sums = new Map();
  for (const bar of lanes.flatMap((lane) => lane.bars)) {
    sums.set(bar.part, (sums.get(bar.part) ?? 0) + bar.to - bar.from);
  }
  return element('ul', { class: 'legend' }, [...sums].map(([part, sum]) => element('li', {},
    element('span', { class: 'bar', 'data-part': part }), `${text.parts[part]} `, element('span', { class: 'legend-time' }, duration(sum)))));
}

function whatOf(step, name) {
  const parts = [];
  if (step.text_size !== undefined) {
    parts.push(text.size(step.text_size));
  } else if (step.text !== undefined) {
    parts.push(element('span', { class: 'said' }, words.quoted(visible(step.text))), ` ${text.stateOf(step.state)}`);
  }
  // The name of the instance stands beside the step.
  const detail = messageOf(step, 'detail');
  if (step.detail && inReadersLanguage(detail) !== name) {
    parts.push(parts.length > 0 ? '  ' : '', explained(detail));
  }
  return parts;
}

function table(timeline, nameOf) {
  const first = milliseconds(timeline.steps[0].time);
  const rows = timeline.steps.map((step) => {
    const at = milliseconds(step.time);
    return element('tr', { 'data-hop': step.hop, 'data-attempt': step.attempt },
      element('td', { 'data-label': text.columns.time }, fineClock(at)),
      element('td', { 'data-label': text.columns.after, class: 'cell-number' }, duration(at - first)),
      element('td', { 'data-label': text.columns.attempt, class: 'cell-number' }, step.attempt || ''),
      element('th', { scope: 'row', 'data-label': text.columns.hop }, text.hops[step.hop] ?? step.hop,
        step.by_service && timeline.clock_difference_ms !== 0 && element('span', { class: 'by-service', title: text.byService }, ' *'),
        step.instance && element('span', { class: 'step-instance' }, ` ${visible(nameOf(step.instance))}`)),
      element('td', { 'data-label': text.columns.what }, whatOf(step, step.instance && nameOf(step.instance))));
  });
  if (timeline.steps[0].hop === 'seen by the gateway') {
    rows.unshift(element('tr', { class: 'untimed' }, element('td', { 'data-label': text.columns.time }), element('td', { 'data-label': text.columns.after }),
      element('td', { 'data-label': text.columns.attempt }),
      element('th', { scope: 'row', 'data-label': text.columns.hop }, text.written), element('td', { 'data-label': text.columns.what }, text.writtenWhat)));
  }
  const { columns } = text;
  return element('table', { class: 'steps' }, element('caption', {}, text.table),
    tableHead(['time', 'after', 'attempt', 'hop', 'what'], columns),
    element('tbody', {}, rows));
}

/** The steps as text, for messages. */
function textOf(timeline, nameOf) {
  const first = milliseconds(timeline.steps[0].time);
  return [`${timeline.call ?? ''} ${timeline.machine}/${timeline.channel} ${timeline.uuid}`, ...timeline.steps.map((step) => [fineClock(milliseconds(step.time)),
    duration(milliseconds(step.time) - first), step.attempt || '', text.hops[step.hop] ?? step.hop, step.instance && nameOf(step.instance),
    step.text !== undefined && `${words.quoted(visible(step.text))} ${text.stateOf(step.state)}`, step.detail && visible(inReadersLanguage(messageOf(step, 'detail')))].filter((part) => part !== undefined && part !== false).join('\t'))].join('\n');
}

/** `nameOf(instance)` is the name of an instance; `now` the end of a call that is in progress. */
export function waterfallChart(timeline, nameOf, now) {
  const layout = layOut(timeline, now);
  const { start, end, lanes, ended } = layout;
  const scale = scaleOf(layout);
  const attempts = lanes.length - 1;
  return element('div', { class: 'timeline' },
    element('div', { class: 'timeline-sum' }, element('span', { class: 'timeline-total' }, text.total(duration(end - start))),
      !ended && element('span', { class: 'timeline-open' }, text.underWay),
      timeline.replayed && element('span', {}, text.replayed), copyButton(() => textOf(timeline, nameOf))),
    element('div', { class: 'waterfall', role: 'img', 'aria-label': text.chartSays(attempts, duration(end - start)) },
      axis(scale, start), lanes.map((lane) => laneNode(lane, scale, nameOf)), legend(lanes)),
    timeline.clock_difference_ms !== 0 && element('p', { class: 'clocks' }, text.clocks(duration(Math.abs(timeline.clock_difference_ms)))),
    scrolling(text.table, table(timeline, nameOf)));
}
