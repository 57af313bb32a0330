// A table of channel × instance with the calls of the last minute, below the advice whether one more instance would help.
import { adviceOf, matrixOf } from '../capacity.js';
import { element, setAttribute, setText, slot, visible } from '../dom.js';
import { busyOfMinute, channelName } from '../model.js';
import { perSecond, words } from '../words.js';
import { scrolling } from './marks.js';

const text = words.services;

/** A rate that rounds to 0 is shown as "<" with the smallest rate. */
const rateText = (rate) => (rate < 0.05 ? '<' + perSecond(0.1) : perSecond(rate));
const heatOf = (rate, top) => (rate > 0 ? Math.ceil((3 * rate) / top) : null);

function cell(rate, column, top) {
  const mark = rate === null ? ['not', text.notIts, '–'] : rate > 0 ? ['yes', '', rateText(rate)] : ['no', text.noCalls, '·'];
  return element('td', { 'data-label': visible(column.channel ? channelName(column) : column.machine), 'data-served': mark[0], 'data-heat': heatOf(rate, top), title: mark[1] || null }, mark[2]);
}

function table({ columns, rows }, busy, caption) {
  const top = Math.max(...rows.flatMap(({ cells }) => cells), 1e-9);
  const isOfChannels = columns.every((column) => column.channel);
  const machines = [...new Set(columns.map((column) => column.machine))];
  const tall = isOfChannels ? 2 : null;
  return element('table', { class: 'matrix' }, element('caption', { class: 'for-readers' }, caption),
    element('thead', {},
      element('tr', {}, element('th', { scope: 'col', rowspan: tall }, text.columns.instance),
        machines.map((machine) => element('th', { scope: isOfChannels ? 'colgroup' : 'col', colspan: columns.filter((column) => column.machine === machine).length, class: 'matrix-machine' }, visible(machine))),
        element('th', { scope: 'col', rowspan: tall, class: 'matrix-busy' }, text.sums.busy)),
      isOfChannels && element('tr', {}, columns.map((column) => element('th', { scope: 'col' }, String(column.channel))))),
    element('tbody', {}, rows.map(({ service, cells }, i) => element('tr', { 'data-instance': service.instance },
      element('th', { scope: 'row' }, visible(service.name || text.nameless), ' ', element('span', { class: 'matrix-where' }, `${service.host}:${service.pid}`)),
      cells.map((rate, column) => cell(rate, columns[column], top)),
      element('td', { class: 'matrix-busy', 'data-label': text.sums.busy }, busy[i] === undefined ? text.noValue : words.plant.busy(busy[i]))))));
}

export function serviceMatrix(app) {
  const advice = element('p', { class: 'capacity' });
  const note = element('p', { class: 'matrix-note' });
  const part = element('div', {});
  const node = element('section', { class: 'matrix-part' }, element('h3', {}, text.matrix), advice, part, note);
  const show = slot(part);
  return {
    node,
    update({ group, history }) {
      const channels = [...app.model.channels.values()];
      const served = history?.served ?? [];
      const lines = history?.instances ?? {};
      const percent = (instances) => {
        const share = busyOfMinute({ instances }, lines);
        return share === undefined ? undefined : Math.round(share * 100);
      };
      const says = adviceOf(group, channels, served, busyOfMinute({ instances: group.instances.filter((service) => !service.draining) }, lines), app.now());
      setAttribute(advice, 'data-advice', says.kind);
      setText(advice, text.advice[says.kind]({ ...says, busy: Math.round(says.busy * 100) }));
      const matrix = matrixOf(group, channels, served);
      const busy = matrix.rows.map(({ service }) => percent([service]));
      const isEmpty = matrix.columns.length === 0 || matrix.rows.length === 0;
      show([matrix.columns, matrix.rows.map(({ service, cells }) => [service.instance, service.name, cells]), busy], () => !isEmpty
        && scrolling(text.matrix, table(matrix, busy, text.matrix)));
      setText(note, isEmpty ? text.noCallsYet : matrix.left > 0 ? `${text.matrixNote} ${words.plant.more(matrix.left)}` : text.matrixNote);
    },
  };
}
