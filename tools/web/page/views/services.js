// The services: a row for each, those with trouble first, then the busiest, or in the order of a column. A row unfolds to
// lines over time, to the channels of each instance, and to its instances. The address has search and order.
import { get } from '../api.js';
import { element, Keyed, replace, setAttribute, setText, visible } from '../dom.js';
import { busyOfMinute, byTrouble } from '../model.js';
import { inOrder, isService, nextOrder, orderOf } from '../search.js';
import { shape } from '../shapes.js';
import { age, clock, duration, milliseconds } from '../time.js';
import { plot, sparkline } from '../parts/plot.js';
import { addressOf, placeholder, scrolling, searchField, tableHead } from '../parts/marks.js';
import { serviceMatrix } from '../parts/service_matrix.js';
import { busyBar, instanceSquares } from '../parts/services_strip.js';
import { number, perSecond, words } from '../words.js';

const text = words.services;
const historyMs = 5000;
const columns = ['instance', 'channels', 'load', 'rate', 'p50', 'p99', 'errors', 'others', 'calls', 'up', 'version', 'state', 'action'];
const sums = ['name', 'instances', 'busy', 'waiting', 'rate', 'p50', 'p99', 'errors'];

function stateOf(service) {
  if (service.goneAt !== undefined) {
    return { name: 'down', word: text.gone, level: 'act' };
  }
  if (service.draining) {
    return { name: 'draining', word: text.draining, level: 'look' };
  }
  return service.running >= service.concurrency ? { name: 'running', word: text.busy, level: 'fine' }
    : { name: service.running > 0 ? 'running' : 'idle', word: text.ready, level: 'fine' };
}

/** The used share of an instance's capacity, as a bar and as text. */
function loadCell() {
  const bar = element('span', { class: 'load-bar' });
  const inWords = element('span', { class: 'load-words' });
  const node = element('span', { class: 'load' }, element('span', { class: 'load-track' }, bar), inWords);
  return {
    node,
    update(service) {
      const running = service.running ?? 0;
      bar.style.width = `${Math.min(100, (100 * running) / Math.max(service.concurrency, 1))}%`;
      setText(inWords, text.load(running, service.concurrency));
    },
  };
}

function instanceRow(app) {
  const cells = Object.fromEntries(columns
    .map((name) => [name, element(name === 'instance' ? 'th' : 'td', {
      'data-label': text.columns[name], class: `cell-${name}`, scope: name === 'instance' ? 'row' : null,
    })]));
  const node = element('tr', {}, Object.values(cells));
  const load = loadCell();
  const line = sparkline(text.plots.rate);
  const rate = element('span', { class: 'rate' });
  cells.load.append(load.node);
  cells.rate.append(rate, line.node);
  let said = '';
  let buttons = '';
  return {
    node,
    update({ service, history }) {
      const state = stateOf(service);
      setAttribute(node, 'data-instance', service.instance);
      setAttribute(node, 'data-level', state.level);
      setAttribute(node, 'data-state', state.word === text.gone ? 'gone' : state.name);
      if (said !== state.word + state.name) {
        said = state.word + state.name;
        replace(cells.state, element('span', { class: 'result', 'data-level': state.level }, shape(state.name),
          service.goneAt === undefined ? state.word : text.goneAt(clock(service.goneAt - app.clockOffset()))));
        replace(cells.instance, element('span', { class: 'instance-name', title: visible(service.description) }, service.name || text.nameless),
          element('span', { class: 'instance-where', title: service.instance }, `${service.host}:${service.pid}`));
        replace(cells.version, visible(service.version), service.certificate && element('span', { class: 'instance-where' }, service.certificate));
      }
      setText(cells.channels, service.channels?.length ? service.channels.map(visible).join(', ') : text.all);
      load.update(service);
      setText(rate, perSecond(service.calls_per_second ?? 0));
      line.update(history?.calls_per_second?.slice(-60) ?? []);
      setText(cells.p50, duration(service.p50_ms));
      setText(cells.p99, duration(service.p99_ms));
      setText(cells.errors, number(service.failed ?? 0));
      setAttribute(cells.errors, 'data-level', service.errors_last_minute > 0 ? 'look' : 'fine');
      setText(cells.others, number(service.other_states ?? 0));
      setText(cells.calls, number(service.answered_calls ?? 0));
      setText(cells.up, service.goneAt === undefined ? age(app.now() - milliseconds(service.started)) : text.noValue);
      const fresh = JSON.stringify([app.session.describe(), service.draining, service.goneAt]);
      if (fresh !== buttons) {
        buttons = fresh;
        replace(cells.action, service.goneAt === undefined && !service.draining && app.session.drainButton(service));
      }
    },
  };
}

/** The content of an unfolded row. */
function unfolded(app) {
  const uuid = element('p', { class: 'service-uuid' });
  const plots = {
    rate: plot(text.plots.rate, [text.plotLabels.calls, text.plotLabels.errors]),
    time: plot(text.plots.time, [text.plotLabels.p50, text.plotLabels.p99]),
  };
  const body = element('tbody');
  const caption = element('caption', { class: 'for-readers' });
  const matrix = serviceMatrix(app);
  const region = scrolling('',
    element('table', { class: 'instances' }, caption, tableHead(columns, { ...text.columns, action: element('span', { class: 'for-readers' }, text.columns.action) }), body));
  const node = element('div', { class: 'service-more', role: 'row', hidden: true }, element('div', { role: 'cell' },
    uuid, element('div', { class: 'plots' }, plots.rate.node, plots.time.node), matrix.node, region));
  const rows = new Keyed(body, () => instanceRow(app));
  return {
    node,
    update({ group, history }) {
      const name = visible(group.name || group.uuid);
      replace(uuid, element('code', {}, group.uuid), ` · ${text.delivery[group.instances[0].delivery] ?? ''}`);
      setText(caption, name);
      setAttribute(region, 'aria-label', name);
      matrix.update({ group, history });
      rows.show(group.instances.map((service) => ({ service, history: history?.instances?.[service.instance] })), ({ service }) => service.instance);
    },
    draw(history, of) {
      const series = history?.services?.[of];
      if (!series) {
        return;
      }
      const end = milliseconds(history.end) - app.clockOffset();
      const times = series.calls_per_second.map((_, i, all) => end - (all.length - 1 - i) * history.step_ms);
      plots.rate.update(times, [series.calls_per_second, series.errors_per_second]);
      plots.time.update(times, [series.p50_ms, series.p99_ms]);
    },
  };
}

function serviceCard(app, opened) {
  const icon = element('span', { class: 'strip-shape' });
  const name = element('span', { class: 'service-name' });
  const cells = Object.fromEntries(sums.slice(1).map((each) => [each, element('span', { class: `sum sum-${each}`, role: 'cell' })]));
  const values = Object.fromEntries(sums.slice(1).map((each) => [each, element('span', { class: 'sum-value' })]));
  for (const each of sums.slice(1)) {
    cells[each].append(element('span', { class: 'sum-label' }, text.sums[each]), values[each]);
  }
  const squares = instanceSquares();
  const busy = busyBar();
  values.instances.append(squares.node);
  values.busy.append(busy.node);
  const toggle = element('button', { type: 'button', class: 'service-toggle', 'aria-expanded': 'false', onclick: () => { opened.flip(node.dataset.uuid); } },
    element('span', { class: 'toggle', 'aria-hidden': 'true' }), name, icon);
  const head = element('div', { class: 'service-row', role: 'row' }, element('div', { class: 'service-head', role: 'rowheader' }, element('h2', {}, toggle)), Object.values(cells));
  const more = unfolded(app);
  const node = element('div', { class: 'service', role: 'rowgroup' }, head, more.node);
  let level = '';
  return {
    node,
    update({ group, load, history }) {
      const isOpen = opened.has(group.uuid);
      const fresh = group.level === 'fine' && (load.errors > 0 || load.waiting > 0) ? 'look' : group.level;
      if (fresh !== level) {
        level = fresh;
        setAttribute(node, 'data-level', level);
        replace(icon, level !== 'fine' && shape(level === 'act' ? 'down' : 'look'));
      }
      setAttribute(node, 'data-uuid', group.uuid);
      setText(name, group.name || text.nameless);
      setAttribute(name, 'title', visible(group.uuid));
      squares.update(group);
      busy.update(busyOfMinute(group, history?.instances ?? {}) ?? load.busy);
      const known = (value) => (group.here > 0 ? value : text.noValue);
      setText(values.waiting, known(number(load.waiting)));
      setAttribute(values.waiting, 'data-level', load.waiting > 0 ? 'look' : 'fine');
      setText(values.rate, known(perSecond(load.rate)));
      setText(values.p50, duration(load.p50));
      setText(values.p99, duration(load.p99));
      setText(values.errors, known(number(load.errors)));
      setAttribute(values.errors, 'data-level', load.errors > 0 ? 'look' : 'fine');
      setAttribute(toggle, 'aria-expanded', String(isOpen));
      setAttribute(node, 'data-open', isOpen);
      const isNew = isOpen && more.node.hidden;
      more.node.hidden = !isOpen;
      if (isOpen) {
        more.update({ group, history });
      }
      if (isNew) {
        more.draw(history, group.uuid);
      }
    },
    draw: (history) => (more.node.hidden ? null : more.draw(history, node.dataset.uuid)),
  };
}

/** The names of the columns, as buttons that change the order; { node, update(order) }. */
function columnHeads(choose) {
  const heads = sums.map((name) => element('span', { class: `sum-${name}`, role: 'columnheader' },
    element('button', { type: 'button', class: 'sort', 'data-sort': name, onclick: () => choose(name) }, text.sums[name])));
  return {
    node: element('div', { role: 'rowgroup' }, element('div', { class: 'service-row service-labels', role: 'row' }, heads)),
    update(order) {
      heads.forEach((head, i) => setAttribute(head, 'aria-sort', order?.column === sums[i] && (order.isDescending ? 'descending' : 'ascending')));
    },
  };
}

/** `open` is the UUID of the service that is unfolded first; the query has `text` and `sort`. */
export function servicesView(app, open, query) {
  const filter = { text: query.get('text') ?? '', sort: query.get('sort') ?? '' };
  /** Each order is a step in the browser's history, each letter is not. */
  const go = (change, keep) => {
    Object.assign(filter, change);
    keep.call(history, null, '', addressOf(open ? `services/${encodeURIComponent(open)}` : 'services', filter));
    view.update();
  };
  const unfoldedOnes = new Set(open ? [open] : []);
  const opened = {
    has: (uuid) => unfoldedOnes.has(uuid),
    flip(uuid) {
      if (!unfoldedOnes.delete(uuid)) {
        unfoldedOnes.add(uuid);
      }
      view.update();
    },
  };
  const list = element('div', { class: 'services' });
  const heads = columnHeads((name) => go({ sort: nextOrder(filter.sort, name) }, history.pushState));
  const search = searchField(text.search, filter.text, (value) => go({ text: value }, history.replaceState));
  const table = element('div', { role: 'table', 'aria-label': text.title }, heads.node, list);
  const form = element('form', { class: 'filter', role: 'search', 'aria-label': text.title, onsubmit: (event) => event.preventDefault() }, search.node);
  const empty = element('div', { hidden: true }, placeholder('empty', text.none, text.noneWhat));
  const noneFits = element('p', { class: 'empty', hidden: true }, text.noneFits);
  const node = element('div', {}, element('h1', { tabindex: '-1' }, text.title), form, table, empty, noneFits);
  const parts = new Map();
  const cards = new Keyed(list, (datum) => {
    const card = serviceCard(app, opened);
    parts.set(datum.group.uuid, card);
    return card;
  });
  let past = null;
  let timer = 0;

  const draw = () => {
    for (const card of parts.values()) {
      card.draw(past);
    }
  };
  const ask = async () => {
    timer = setTimeout(ask, historyMs);
    // On an error the next request is five seconds later; a lost connection is shown above.
    const fresh = await get(['history']).catch(() => null);
    if (fresh && node.isConnected) {
      past = fresh;
      view.update();
      draw();
    }
  };
  const view = {
    node,
    title: () => text.title,
    update() {
      const all = app.model.servicesByUuid();
      const order = orderOf(filter.sort);
      const groups = inOrder(byTrouble(all.filter((group) => isService(group, filter.text))), order);
      heads.update(order);
      empty.hidden = all.length > 0;
      form.hidden = all.length === 0 && !filter.text;
      noneFits.hidden = all.length === 0 || groups.length > 0;
      table.hidden = groups.length === 0;
      cards.show(groups.map(({ group, load }) => ({ group, load, history: past })), ({ group }) => group.uuid);
      for (const uuid of parts.keys()) {
        if (!groups.some(({ group }) => group.uuid === uuid)) {
          parts.delete(uuid);
        }
      }
    },
    enter() {
      ask();
    },
    leave() {
      clearTimeout(timer);
      search.stop();
    },
  };
  return view;
}
