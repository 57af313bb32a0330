// The recordings in the server's folder: a list; for each recording its summary, its calls and its file.
import { get } from '../api.js';
import { callsTable, resultChooser } from '../parts/calls_table.js';
import { facts, placeholder, scrolling, tableHead } from '../parts/marks.js';
import { element, replace, setText, visible } from '../dom.js';
import { duration, milliseconds, moment } from '../time.js';
import { number, size, words } from '../words.js';

const text = words.recordings;
const perPage = 100;

const fileOf = (name) => `/api/recordings/${encodeURIComponent(name)}/file`;
const failure = (problem) => placeholder('failure', words.failure.title, problem.message);

export function recordingsView(app) {
  const content = element('div', {}, element('p', {}, words.showing));
  const node = element('div', {}, element('h1', { tabindex: '-1' }, text.title), content);
  const clock = (time) => (time ? moment(milliseconds(time) - app.clockOffset(), Date.now()) : '');
  const row = (recording) => element('tr', {},
    element('th', { scope: 'row', 'data-label': text.columns.name },
      element('a', { href: `#/recordings/${encodeURIComponent(recording.name)}` }, visible(recording.name)),
      recording.writing !== undefined && element('span', { class: 'detail' }, recording.writing ? text.writing : text.interrupted)),
    element('td', { 'data-label': text.columns.machines }, (recording.machines ?? []).map(visible).join(', ')),
    element('td', { 'data-label': text.columns.from }, clock(recording.start)),
    element('td', { 'data-label': text.columns.to }, clock(recording.end ?? recording.modified)),
    element('td', { 'data-label': text.columns.calls, class: 'cell-number' }, number(recording.calls)),
    element('td', { 'data-label': text.columns.failed, class: 'cell-number' }, number(recording.failed)),
    element('td', { 'data-label': text.columns.size, class: 'cell-number' }, size(recording.size)),
    element('td', { 'data-label': text.columns.download }, element('a', { href: fileOf(recording.name), download: true, 'aria-label': text.downloadOf(visible(recording.name)) }, text.download)));
  return {
    node,
    title: () => text.title,
    update() {},
    async enter() {
      try {
        const { recordings } = await get(['recordings']);
        replace(content, recordings.length === 0 ? placeholder('empty', text.none, text.noneWhat)
          : element('table', { class: 'recordings' }, element('caption', { class: 'for-readers' }, text.title),
            tableHead(['name', 'machines', 'from', 'to', 'calls', 'failed', 'size', 'download'], text.columns),
            element('tbody', {}, recordings.map(row))));
      } catch (problem) {
        replace(content, failure(problem));
      }
    },
  };
}

function summary(info) {
  const from = milliseconds(info.start);
  const to = milliseconds(info.end);
  return [
    facts('recording-facts', [
      [text.from, moment(from)],
      [text.to, moment(to)],
      [text.lasted, duration(to - from)],
      [text.size, size(info.size)],
      [text.messages, number(info.messages)],
      [text.writer, visible(info.library)],
      [text.state, info.closed ? text.closed : text.open],
    ]),
    info.problems?.length > 0 && element('div', { class: 'placeholder', 'data-kind': 'failure' }, element('p', { class: 'placeholder-title' }, text.problems),
      element('ul', {}, info.problems.map((problem) => element('li', { lang: 'en' }, text.problem(number(problem.offset), visible(problem.text)))))),
    info.hops?.length > 0 && scrolling(text.hops,
      element('table', { class: 'hops' }, element('caption', {}, text.hops),
        tableHead(['service', 'hop', 'calls', 'p50', 'p99', 'max'], text.hopColumns),
        element('tbody', {}, info.hops.map((hop, i, all) => element('tr', {},
          element('td', {}, all[i - 1]?.uuid === hop.uuid ? '' : visible(hop.uuid)), element('th', { scope: 'row', lang: 'en' }, hop.hop),
          element('td', { class: 'cell-number' }, number(hop.calls)), element('td', { class: 'cell-number' }, duration(hop.p50_ms)),
          element('td', { class: 'cell-number' }, duration(hop.p99_ms)), element('td', { class: 'cell-number' }, duration(hop.max_ms))))))),
  ];
}

/** The recorded alarms. */
function alarmTable({ alarms, more }) {
  return alarms.length > 0 && [scrolling(text.alarms,
    element('table', { class: 'alarms' }, element('caption', {}, text.alarms), tableHead(['time', 'program', 'level', 'what'], text.alarmColumns),
      element('tbody', {}, alarms.map((each) => element('tr', {},
        element('td', {}, moment(milliseconds(each.time))), element('th', { scope: 'row' }, `${visible(each.program || each.responder)} · ${visible(each.host)}`),
        element('td', {}, each.over ? text.over : words.doctor.severity[each.level] ?? each.level),
        element('td', { lang: 'en' }, visible(each.text || each.alarm), element('span', { class: 'detail' }, each.advice))))))),
  more && element('p', { class: 'list-status' }, text.more)];
}

export function recordingView(app, name, query) {
  const skip = Math.max(0, Number(query.get('skip')) || 0);
  const result = query.get('result') ?? '';
  const about = element('div', {}, element('p', {}, words.showing));
  const said = element('div');
  const status = element('p', { class: 'list-status' });
  const table = callsTable((call) => `#/recordings/${encodeURIComponent(name)}/${encodeURIComponent(call.call)}`, () => NaN);
  const pages = element('nav', { class: 'pages', 'aria-label': text.calls });
  const here = (change) => {
    const wanted = new URLSearchParams(Object.entries({ skip, result, ...change }).filter(([, value]) => value));
    return `#/recordings/${encodeURIComponent(name)}${String(wanted) ? `?${wanted}` : ''}`;
  };
  const filtered = resultChooser(result, (value) => { location.hash = here({ skip: 0, result: value }); });
  const node = element('div', {},
    element('nav', { class: 'back', 'aria-label': text.back }, element('a', { href: '#/recordings' }, `← ${text.back}`)),
    element('h1', { tabindex: '-1' }, name),
    element('p', {}, element('a', { class: 'act', href: fileOf(name), download: true }, text.download)),
    about, said,
    element('h2', {}, text.calls),
    element('form', { class: 'filter', 'aria-label': words.calls.filter, onsubmit: (event) => event.preventDefault() },
      filtered.node, status),
    table.node, pages);
  return {
    node,
    title: () => visible(name),
    update() {},
    async enter() {
      get(['recordings', name]).then((info) => replace(about, ...summary(info)), (problem) => replace(about, failure(problem)));
      // If the file cannot be read, the summary shows the reason.
      get(['recordings', name, 'alarms']).then((answer) => replace(said, alarmTable(answer)), () => {});
      try {
        const { calls, more } = await get(['recordings', name, 'calls'], { result, limit: perPage, skip: skip || '' });
        table.show(calls);
        setText(status, calls.length === 0 ? words.calls.noneFiltered : text.page(number(skip + 1), number(skip + calls.length)));
        replace(pages, skip > 0 && element('a', { href: here({ skip: Math.max(0, skip - perPage) }) }, `← ${text.earlier}`),
          more && element('a', { href: here({ skip: skip + perPage }) }, `${text.later} →`));
      } catch (problem) {
        setText(status, problem.message);
      }
    },
  };
}
