// The services: per UUID what they do and how fast, with lines over time; per instance who, where, how much.
import { get } from '../api.js';
import { element, Keyed, replace, setAttribute, setText } from '../dom.js';
import { shape } from '../shapes.js';
import { clock, duration, milliseconds } from '../time.js';
import { plot, sparkline } from '../parts/plot.js';
import { notice, scrolling, tableHead, visible } from '../parts/marks.js';
import { number, perSecond, words } from '../words.js';

const text = words.services;
const historyMs = 5000;
const columns = ['instance', 'host', 'channels', 'load', 'rate', 'p50', 'p99', 'errors', 'others', 'calls', 'version', 'state', 'action'];

function stateOf(service) {
  if (service.goneAt !== undefined) {
    return { name: 'down', word: text.gone, level: 'person' };
  }
  if (service.draining) {
    return { name: 'draining', word: text.draining, level: 'look' };
  }
  return service.running >= service.concurrency ? { name: 'running', word: text.busy, level: 'fine' }
    : { name: service.running > 0 ? 'running' : 'idle', word: text.ready, level: 'fine' };
}

/** How much of its room an instance uses, as a bar and in words. */
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
        replace(cells.instance, element('span', { class: 'instance-name', title: visible(service.description) }, visible(service.name || text.nameless)),
          element('span', { class: 'instance-id' }, service.instance));
        replace(cells.host, visible(service.host), element('span', { class: 'pid' }, ` ${text.pid(service.pid)}`));
        setText(cells.version, visible(service.version));
      }
      setText(cells.channels, service.channels?.length ? service.channels.map(visible).join(', ') : text.all);
      load.update(service);
      setText(rate, perSecond(service.calls_per_second ?? 0));
      line.update(history?.calls_per_second?.slice(-60) ?? []);
      setText(cells.p50, duration(service.p50_ms));
      setText(cells.p99, duration(service.p99_ms));
      setText(cells.errors, service.failed ? `${number(service.failed)}${service.errors_per_second ? ` · ${text.errorsPerSecond(perSecond(service.errors_per_second))}` : ''}` : '0');
      setAttribute(cells.errors, 'data-level', service.errors_per_second > 0 ? 'look' : 'fine');
      setText(cells.others, number(service.other_states ?? 0));
      setText(cells.calls, number(service.answered_calls ?? 0));
      const fresh = JSON.stringify([app.session.describe(), service.draining, service.goneAt]);
      if (fresh !== buttons) {
        buttons = fresh;
        replace(cells.action, service.goneAt === undefined && !service.draining && app.session.drainButton(service));
      }
    },
  };
}

function serviceCard(app) {
  const name = element('h2', { class: 'service-name' });
  const uuid = element('p', { class: 'service-uuid' });
  const sum = element('p', { class: 'service-sum' });
  const plots = {
    rate: plot(text.plots.rate, [text.plotLabels.calls, text.plotLabels.errors]),
    time: plot(text.plots.time, [text.plotLabels.p50, text.plotLabels.p99]),
  };
  const body = element('tbody');
  const caption = element('caption', { class: 'for-readers' });
  const region = scrolling('',
    element('table', { class: 'instances' }, caption, tableHead(columns, { ...text.columns, action: element('span', { class: 'for-readers' }, text.columns.action) }), body));
  const node = element('article', { class: 'service' },
    element('header', {}, element('div', {}, name, uuid), sum),
    element('div', { class: 'plots' }, plots.rate.node, plots.time.node),
    region);
  const rows = new Keyed(body, () => instanceRow(app));
  return {
    node,
    update({ group, history }) {
      setText(name, visible(group.name || text.nameless));
      setText(uuid, visible(group.uuid));
      setText(caption, visible(group.name || group.uuid));
      setAttribute(region, 'aria-label', visible(group.name || group.uuid));
      setText(sum, group.here === 0 ? text.goneAll
        : `${text.instances(group.here)} · ${words.plant.rate(perSecond(group.instances.reduce((all, each) => all + (each.goneAt === undefined ? each.calls_per_second ?? 0 : 0), 0)))} · ${text.delivery[group.instances[0].delivery] ?? ''}`);
      setAttribute(node, 'data-level', group.here === 0 ? 'person' : 'fine');
      setAttribute(node, 'data-uuid', group.uuid);
      rows.show(group.instances.map((service) => ({ service, history: history?.instances?.[service.instance] })), ({ service }) => service.instance);
    },
    draw(history) {
      const series = history.services?.[node.dataset.uuid];
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

export function servicesView(app) {
  const list = element('div', { class: 'services' });
  const empty = element('div', { hidden: true }, notice('empty', text.none, text.noneWhat));
  const node = element('div', {}, element('h1', { tabindex: '-1' }, text.title), list, empty);
  const parts = new Map();
  const cards = new Keyed(list, (datum) => {
    const card = serviceCard(app);
    parts.set(datum.group.uuid, card);
    return card;
  });
  let history = null;
  let timer = 0;

  const draw = () => {
    for (const card of parts.values()) {
      card.draw(history);
    }
  };
  const ask = async () => {
    timer = setTimeout(ask, historyMs);
    // What cannot be had now comes in five seconds; that there is no connection is said above.
    const fresh = await get(['history']).catch(() => null);
    if (fresh && node.isConnected) {
      history = fresh;
      view.update();
      draw();
    }
  };
  const view = {
    node,
    title: () => text.title,
    update() {
      const groups = app.model.servicesByUuid();
      empty.hidden = groups.length > 0;
      cards.show(groups.map((group) => ({ group, history })), ({ group }) => group.uuid);
      for (const uuid of parts.keys()) {
        if (!groups.some((group) => group.uuid === uuid)) {
          parts.delete(uuid);
        }
      }
    },
    enter() {
      ask();
    },
    leave() {
      clearTimeout(timer);
    },
    themeChanged() {
      if (history) {
        draw();
      }
    },
  };
  return view;
}
