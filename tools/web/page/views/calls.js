// The calls as they end, newest first, with a filter; the filter stands in the address, so that it can be kept and sent.
import { get } from '../api.js';
import { byName } from '../model.js';
import { callsTable, countCalls } from '../parts/calls_table.js';
import { chooser, visible } from '../parts/marks.js';
import { element, setText } from '../dom.js';
import { words } from '../words.js';

const text = words.calls;
/** Where a row is a card, fewer are enough. */
const shownRows = matchMedia('(max-width: 60rem)').matches ? 40 : 120;
/** A list that changes more often cannot be read, and costs the browser more than it shows. */
const betweenMs = 450;

function fits(call, filter) {
  return (!filter.machine || call.machine === filter.machine) && (!filter.channel || String(call.channel) === filter.channel)
    && (!filter.uuid || call.uuid === filter.uuid)
    && ((!filter.failed && !filter.other_state) || (filter.failed && call.failed) || (filter.other_state && call.result === 'other_state'));
}

export function callsView(app, query) {
  const filter = {
    machine: query.get('machine') ?? '', channel: query.get('channel') ?? '', uuid: query.get('uuid') ?? '', failed: query.get('failed') ? '1' : '',
    other_state: query.get('other_state') ? '1' : '',
  };
  const isFiltered = Object.values(filter).some(Boolean);
  const go = (change) => {
    const wanted = new URLSearchParams(Object.entries({ ...filter, ...change }).filter(([, value]) => value));
    location.hash = `#/calls${String(wanted) ? `?${wanted}` : ''}`;
  };
  const machine = chooser(text.machine, filter.machine, (value) => go({ machine: value, channel: '' }));
  const channel = chooser(text.channel, filter.channel, (value) => go({ channel: value }));
  const service = chooser(text.service, filter.uuid, (value) => go({ uuid: value }));
  const failed = element('input', { type: 'checkbox', checked: Boolean(filter.failed), onchange: () => go({ failed: failed.checked ? '1' : '' }) });
  const others = element('input', { type: 'checkbox', checked: Boolean(filter.other_state), onchange: () => go({ other_state: others.checked ? '1' : '' }) });
  const pauseButton = element('button', { type: 'button', 'aria-pressed': 'false', onclick: () => pause(frozen === null) }, text.pause);
  const status = element('p', { class: 'list-status' });
  const empty = element('p', { class: 'empty', hidden: true });
  const table = callsTable((call) => `#/calls/${encodeURIComponent(call.call)}`);
  const node = element('div', { class: 'calls-view' },
    element('h1', { tabindex: '-1' }, text.title),
    element('form', { class: 'filter', 'aria-label': text.filter, onsubmit: (event) => event.preventDefault() },
      machine.node, channel.node, service.node, element('label', { class: 'tick' }, failed, element('span', {}, text.failed)),
      element('label', { class: 'tick' }, others, element('span', {}, text.otherStates)),
      isFiltered && element('button', { type: 'button', onclick: () => { location.hash = '#/calls'; } }, text.clear),
      pauseButton, status),
    table.node, empty);

  // What the server kept of calls that fit, beyond the last ones that the page has anyway.
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
    // The filter leaves out what is missing, too, unless it is a time without data: whether that would fit is unknown.
    const live = app.model.calls.filter((row) => (row.call ? fits(row, filter) : row.gap || !isFiltered));
    const known = new Set(live.map((row) => row.call));
    return [...live, ...kept.filter((call) => !known.has(call.call))].slice(0, shownRows);
  }

  function cameSince() {
    const at = app.model.calls.findIndex((row) => row.call && row.call === newest);
    return (at < 0 ? app.model.calls : app.model.calls.slice(0, at))
      .reduce((all, row) => all + (row.call ? Number(fits(row, filter)) : isFiltered ? 0 : row.skipped ?? 0), 0);
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
      const now = performance.now();
      if (now - last < betweenMs) {
        return;
      }
      last = now;
      const rows = frozen ?? rowsNow();
      table.show(rows);
      const count = countCalls(rows);
      setText(status, frozen ? text.paused(cameSince()) : isFiltered && count > 0 ? text.shown(count) : '');
      empty.hidden = rows.length > 0;
      setText(empty, isFiltered ? text.noneFiltered : text.none);
    },
    async enter() {
      const answer = await get(['calls'], { ...filter, limit: shownRows }).catch(() => null);
      if (answer) {
        kept = answer.calls;
        last = 0;
        view.update();
      }
    },
  };
  return view;
}
