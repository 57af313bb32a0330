// Calls as they end, newest first, with a filter. The address contains the filter, so that it can be kept and shared.
import { get } from '../api.js';
import { byName } from '../model.js';
import { callsTable, countCalls, resultChooser } from '../parts/calls_table.js';
import { addressOf, chooser, searchField } from '../parts/marks.js';
import { element, setText, visible } from '../dom.js';
import { words } from '../words.js';

const text = words.calls;
/** Cards need fewer rows. */
const shownRows = matchMedia('(max-width: 60rem)').matches ? 40 : 120;
/** More frequent updates are unreadable and load the browser. */
const betweenMs = 450;
const parts = ['machine', 'channel', 'uuid', 'instance', 'result', 'text'];

function fits(call, filter) {
  const has = (said) => said?.toLowerCase().includes(filter.text.toLowerCase());
  return ['machine', 'channel', 'uuid', 'instance', 'result'].every((part) => !filter[part] || String(call[part]) === filter[part])
    && (!filter.text || has(call.request) || has(call.response));
}

export function callsView(app, query) {
  const filter = Object.fromEntries(parts.map((part) => [part, query.get(part) ?? '']));
  const isFiltered = () => Object.values(filter).some(Boolean);
  /** Keeps the view and its scroll position. Each choice is a step in the browser's history, each letter is not. */
  const go = (change, keep = history.pushState) => {
    Object.assign(filter, change);
    keep.call(history, null, '', addressOf('calls', filter));
    kept = [];
    frozen = null;
    last = 0;
    clear.hidden = !isFiltered();
    view.update();
    ask();
  };
  const machine = chooser(text.machine, filter.machine, (value) => { channel.choose(''); go({ machine: value, channel: '' }); });
  const channel = chooser(text.channel, filter.channel, (value) => go({ channel: value }));
  const service = chooser(text.service, filter.uuid, (value) => { instance.choose(''); go({ uuid: value, instance: '' }); });
  const instance = chooser(text.columns.instance, filter.instance, (value) => go({ instance: value }));
  const result = resultChooser(filter.result, (value) => go({ result: value }));
  const search = searchField(text.text, filter.text, (value) => go({ text: value }, history.replaceState));
  const clear = element('button', { type: 'button', hidden: !isFiltered(), onclick: () => { location.hash = '#/calls'; } }, text.clear);
  const pauseButton = element('button', { type: 'button', 'aria-pressed': 'false', onclick: () => pause(frozen === null) }, text.pause);
  const status = element('p', { class: 'list-status' });
  const empty = element('p', { class: 'empty', hidden: true });
  const table = callsTable((call) => `#/calls/${encodeURIComponent(call.call)}`);
  const node = element('div', { class: 'calls-view' },
    element('h1', { tabindex: '-1' }, text.title),
    element('form', { class: 'filter', 'aria-label': text.filter, onsubmit: (event) => event.preventDefault() },
      machine.node, channel.node, service.node, instance.node, result.node,
      search.node, clear, pauseButton, status),
    table.node, empty);

  // Matching calls of the server that are older than those of the page.
  let kept = [];
  let frozen = null;
  let last = 0;
  let newest = null;

  function pause(on) {
    frozen = on ? rowsNow() : null;
    newest = app.model.calls.find((row) => row.call)?.call ?? null;
    setText(pauseButton, on ? text.resume : text.pause);
    pauseButton.setAttribute('aria-pressed', String(on));
    last = 0;
    view.update();
  }

  function rowsNow() {
    // The filter also hides entries for missing calls, except a time without data, which may contain matching calls.
    const live = app.model.calls.filter((row) => (row.call ? fits(row, filter) : row.gap || !isFiltered()));
    const known = new Set(live.map((row) => row.call));
    return [...live, ...kept.filter((call) => !known.has(call.call))].slice(0, shownRows);
  }

  function cameSince() {
    const at = app.model.calls.findIndex((row) => row.call && row.call === newest);
    return (at < 0 ? app.model.calls : app.model.calls.slice(0, at))
      .reduce((all, row) => all + (row.call ? Number(fits(row, filter)) : isFiltered() ? 0 : row.skipped ?? 0), 0);
  }

  async function ask() {
    const asked = JSON.stringify(filter);
    const answer = await get(['calls'], { ...filter, limit: shownRows }).catch(() => null);
    if (answer && asked === JSON.stringify(filter)) {
      kept = answer.calls;
      last = 0;
      view.update();
    }
  }

  const view = {
    node,
    title: () => text.title,
    update() {
      const { model } = app;
      const machines = model.plant();
      machine.show(machines.map(({ name }) => [name, visible(name)]));
      channel.show((machines.find(({ name }) => name === filter.machine)?.channels ?? []).map((each) => [String(each.channel), String(each.channel)]));
      service.show(model.servicesByUuid().map((group) => [group.uuid, visible(group.name || group.uuid)]).sort((a, b) => byName(a[1], b[1])));
      const instances = filter.uuid ? model.servicesByUuid().find((group) => group.uuid === filter.uuid)?.instances ?? [] : [];
      instance.node.hidden = instances.length === 0 && !filter.instance;
      instance.show(instances.map((each) => [each.instance, visible(`${each.name || words.services.nameless} (${each.host}:${each.pid})`)]));
      const now = performance.now();
      if (now - last < betweenMs) {
        return;
      }
      last = now;
      const rows = frozen ?? rowsNow();
      table.show(rows);
      const count = countCalls(rows);
      setText(status, frozen ? text.paused(cameSince()) : isFiltered() && count > 0 ? text.shown(count) : '');
      empty.hidden = rows.length > 0;
      setText(empty, isFiltered() ? text.noneFiltered : text.none);
    },
    enter: ask,
    leave: search.stop,
  };
  return view;
}
