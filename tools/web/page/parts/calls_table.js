// A list of calls: time, channel, service, request, response, duration, instance, result. A row opens its timeline.
import { channelName, toolOf } from '../model.js';
import { element, Keyed, visible } from '../dom.js';
import { shape } from '../shapes.js';
import { messageOf } from '../texts/sentences.js';
import { clock, duration, fineClock, milliseconds, moment } from '../time.js';
import { words } from '../words.js';
import { chooser, explained, tableHead } from './marks.js';

const text = words.calls;
const columns = ['time', 'channel', 'service', 'request', 'response', 'duration', 'instance', 'result'];

function quoted(value, state) {
  return value === undefined ? [element('span', { class: 'unseen' }, text.unknown)]
    : [element('div', { class: 'clamp' }, element('span', { class: 'said' }, words.quoted(visible(value))),
      state !== undefined && element('span', { class: 'number-state' }, ` ${state}`))];
}

function resultOf(call) {
  if (call.end === 'withdrawn') {
    return { word: text.withdrawn, name: call.failed ? 'down' : 'idle' };
  }
  if (call.result === 'other_state') {
    return { word: text.otherState(call.response_state), name: 'look', level: 'look' };
  }
  return call.failed ? { word: text.failedWord, name: 'down' } : { word: text.ok, name: 'well' };
}

function callRow(call, hrefOf, dayOf) {
  const result = resultOf(call);
  const ended = milliseconds(call.ended);
  const cell = (column, ...content) => element('td', { 'data-label': text.columns[column], class: `cell-${column}` }, content);
  const attempts = call.attempt > 1 && element('span', { class: 'attempts' }, ` ${text.attempts(call.attempt)}`);
  const where = call.name || call.instance ? `${visible(call.name || call.instance)}${call.host ? ` @ ${visible(call.host)}` : ''}` : '–';
  return element('tr', { 'data-call': call.call, 'data-failed': String(Boolean(call.failed)), 'data-result': call.result ?? '' },
    element('th', { scope: 'row', class: 'cell-time', 'data-label': text.columns.time },
      element('a', { href: hrefOf(call), title: text.open(call.call) }, dayOf ? moment(ended, dayOf()) : fineClock(ended).slice(0, 12))),
    cell('channel', visible(channelName(call)), toolOf(call) && element('span', { class: 'detail' }, toolOf(call))),
    cell('service', element('span', { title: visible(call.uuid) }, call.service || call.uuid)),
    cell('request', quoted(call.request, call.request_state)),
    cell('response', call.end === 'withdrawn' ? '–' : quoted(call.response, call.response_state)),
    cell('duration', duration(call.duration_ms)),
    cell('instance', element('span', { title: where }, where)),
    cell('result', element('span', { class: 'result', 'data-level': result.level ?? (call.failed ? 'act' : 'fine') }, shape(result.name), result.word),
      attempts, call.replayed && element('span', { class: 'replayed' }, ` ${text.replayed}`),
      call.detail && [' ', explained(messageOf(call, 'detail'), 'detail')]));
}

/** A row for missing calls. */
function missingRow(missing) {
  const lacks = missing.gap ? text.gap(clock(missing.gap.from), clock(missing.gap.to)) : text.skipped(missing.skipped);
  return element('tr', { class: 'missing', 'data-missing': missing.gap ? 'gap' : 'skipped' },
    element('td', { colspan: columns.length }, element('span', {}, lacks)));
}

let missingNumber = 0;
const missingKeys = new WeakMap();

function keyOfRow(row) {
  if (row.call) {
    return row.call;
  }
  if (!missingKeys.has(row)) {
    missingKeys.set(row, `missing ${(missingNumber += 1)}`);
  }
  return `${missingKeys.get(row)} ${row.skipped ?? ''}`;
}

/** { node, show(calls) }; `hrefOf(call)` is the link of a row, `dayOf()` today's time, where days may differ. */
export function callsTable(hrefOf, dayOf = null) {
  const body = element('tbody');
  const node = element('table', { class: 'calls' },
    element('caption', { class: 'for-readers' }, text.title),
    tableHead(columns, text.columns),
    body);
  // A click anywhere in the row follows its link.
  body.addEventListener('click', (event) => {
    const row = event.target.closest('tr[data-call]');
    if (row && !event.target.closest('a') && String(getSelection()) === '') {
      row.querySelector('a').click();
    }
  });
  const rows = new Keyed(body, (row) => ({ node: row.call ? callRow(row, hrefOf, dayOf) : missingRow(row), update() {} }));
  return {
    node,
    show(calls) {
      rows.show(calls, keyOfRow);
    },
  };
}

/** A selection of results; `chosen` is a result of /api/calls, or empty. */
export function resultChooser(chosen, changed) {
  const result = chooser(text.columns.result, chosen, changed);
  result.show(Object.entries(text.results));
  return result;
}

export function countCalls(rows) {
  return rows.filter((row) => row.call).length;
}

