// Machine data and programs: lines over time of chosen variables, below the programs that ran; all values of the machine; the
// runs. The address contains the choice.
import { get } from '../api.js';
import { isNumber, Line, placeOf, qualityOf, variablesOf } from '../lines.js';
import { byName } from '../model.js';
import { element, Keyed, replace, setAttribute, setText, visible } from '../dom.js';
import { shape } from '../shapes.js';
import { messageOf } from '../texts/sentences.js';
import { age, clock, duration, milliseconds, moment, period } from '../time.js';
import { plot } from '../parts/plot.js';
import { chooser, explained, scrolling, tableHead } from '../parts/marks.js';
import { number, words } from '../words.js';

const text = words.data;
/** How often lines and values are requested. */
const lineMs = 500;
const tableMs = 2000;
const most = 12;
const mostRuns = 100;
/** Lines that are shown without a choice. */
const first = 3;
const spans = [60, 120, 300, 600];
const marks = { good: ['well', 'fine'], stale: ['unknown', 'look'], refused: ['down', 'act'], unknown: ['unknown', 'look'] };
const outcomes = {
  running: ['running', 'fine'], 'on hold': ['held', 'look'], ended: ['well', 'fine'], aborted: ['down', 'act'], reset: ['look', 'look'],
  unknown: ['unknown', 'look'],
};

const mark = ([form, level], word) => element('span', { class: 'result', 'data-level': level }, shape(form), word);
const replayed = (is) => is && element('span', { class: 'replayed' }, ` ${words.calls.replayed}`);
/** Why a value is not good. */
const why = (gone, reason) => (gone ? element('span', { class: 'detail' }, text.gone) : reason && explained(reason, 'detail'));
const beginOf = (run) => milliseconds(run.started ?? run.told);

/** Names of the values of a variable from 0 on; null for numbers. */
const namesOf = (name, type) => (type === 'BOOLEAN' ? ['FALSE', 'TRUE'] : text.names[name] ?? null);

/** A value as text for readers. */
function shown(value, name) {
  const word = Number.isInteger(value) ? text.names[name]?.[value] : undefined;
  if (word) {
    return `${word} (${value})`;
  }
  if (value === null || value === undefined) {
    return words.services.noValue;
  }
  if (Array.isArray(value)) {
    return value.map(shown).join('; ');
  }
  return typeof value === 'number' ? number(value, 4) : typeof value === 'string' ? words.quoted(visible(value)) : String(value).toUpperCase();
}

/** A chosen variable: its line, or the last values if they are not numbers. */
function lineCard(app, id, type, zoomed) {
  const name = visible(id.slice(id.indexOf('/', id.indexOf('/') + 1) + 1));
  const state = element('span', { class: 'line-state' });
  const drawn = plot(name, [name], { step: true, side: state, names: namesOf(name, type), zoomed });
  const list = element('ol', { class: 'changes', hidden: true });
  const node = element('div', { class: 'line', 'data-variable': id }, drawn.node, list);
  let lastShown = '';
  return {
    node,
    update({ line, from, to, now, offset }) {
      const { now: value } = line;
      const quality = value ? qualityOf(value.gone, value.quality) : 'stale';
      const lasting = value?.at ? age(now - milliseconds(value.at)) : '';
      const fresh = JSON.stringify([value?.text, quality, value?.reason, value?.gone, value?.replayed, quality === 'stale' && lasting]);
      if (fresh !== lastShown) {
        lastShown = fresh;
        setAttribute(node, 'data-quality', quality);
        replace(state, element('strong', {}, value?.array ? visible(value.text) : shown(value?.value, name)), replayed(value?.replayed),
          quality !== 'good' && mark(marks[quality], `${text.quality[quality]}${quality === 'stale' && lasting ? ` ${lasting}` : ''}`),
          value && why(value.gone, messageOf(value, 'reason')));
      }
      const isLine = !value || isNumber(value);
      list.hidden = isLine;
      drawn.area.hidden = !isLine;
      if (isLine) {
        const points = line.points(from, to);
        drawn.update(points.map(([time]) => time - offset), [points.map(([, each]) => each)], [from - offset, to - offset]);
      } else {
        replace(list, (value.changes ?? []).slice(-6).reverse().map((change) => element('li', {}, `${clock(change.at - offset)}  ${visible(change.text)}`)));
      }
    },
  };
}

/** Runs of a channel, as bars over the time of the lines. */
function band() {
  const label = element('span', { class: 'band-channel' });
  const lane = element('div', { class: 'band-lane' });
  const bars = new Keyed(lane, () => {
    const node = element('div', { class: 'band-run' });
    let lastShown = '';
    return {
      node,
      update({ run, place }) {
        const fresh = run.state + run.program;
        if (fresh !== lastShown) {
          lastShown = fresh;
          setAttribute(node, 'data-state', run.state);
          // There is no room for the folder.
          replace(node, shape(outcomes[run.state]?.[0]), element('span', {}, run.program.split(/[\\/]/).at(-1) || text.noName));
        }
        node.style.left = `${100 * place.left}%`;
        node.style.width = `${100 * place.width}%`;
      },
    };
  });
  const node = element('div', { class: 'band', 'aria-hidden': 'true' }, label, lane);
  return {
    node,
    update({ channel, runs, from, to, now }) {
      setText(label, words.plant.channel(channel));
      bars.show(runs.map((run) => ({ run, place: placeOf(beginOf(run), run.ended ? milliseconds(run.ended) : run.state === 'unknown' ? milliseconds(run.told) : now, from, to) }))
        .filter(({ place }) => place), ({ run }) => beginOf(run));
    },
  };
}

function variableRow(choose) {
  const tick = element('input', { type: 'checkbox' });
  const columns = ['variable', 'value', 'quality', 'read', 'group', 'every'];
  const cells = Object.fromEntries(columns.map((name) => [name, element(name === 'variable' ? 'th' : 'td', {
    'data-label': text.columns[name], class: `cell-${name}`, scope: name === 'variable' ? 'row' : null,
  })]));
  const name = element('span');
  cells.variable.append(element('label', { class: 'tick' }, tick, name));
  const node = element('tr', {}, Object.values(cells));
  let id = '';
  let lastShown = '';
  tick.addEventListener('change', () => choose(id, tick.checked));
  return {
    node,
    update({ variable, isChosen, now }) {
      const { sample, value } = variable;
      id = variable.id;
      tick.checked = isChosen;
      const quality = qualityOf(sample.gone, value.quality);
      setText(name, value.name);
      setAttribute(node, 'data-variable', id);
      setText(cells.value, `${shown(value.value, value.name)}${value.elements ? text.elements(number(value.elements)) : ''}`);
      setText(cells.read, value.at ? text.ago(age(now - milliseconds(value.at))) : words.services.noValue);
      setText(cells.group, `${visible(sample.group)} · ${words.plant.channel(sample.channel)}`);
      setText(cells.every, sample.period_ms > sample.wanted_ms ? text.slow(period(sample.period_ms), period(sample.wanted_ms)) : period(sample.wanted_ms));
      const fresh = quality + value.reason + sample.gone + sample.replayed;
      if (fresh !== lastShown) {
        lastShown = fresh;
        setAttribute(node, 'data-quality', quality);
        replace(cells.quality, mark(marks[quality], text.quality[quality]), replayed(sample.replayed),
          why(sample.gone, messageOf(value, 'reason')));
      }
    },
  };
}

const runColumns = ['channel', 'program', 'started', 'took', 'outcome', 'error', 'parts'];

function runRow(app) {
  const cells = Object.fromEntries(runColumns.map((name) => [name, element(name === 'program' ? 'th' : 'td', {
    'data-label': text.runColumns[name], class: `cell-${name}`, scope: name === 'program' ? 'row' : null,
  })]));
  const node = element('tr', {}, Object.values(cells));
  return {
    node,
    update({ run, now }) {
      const ran = run.ended ? run.duration_s * 1000 : run.state === 'unknown' ? NaN : now - milliseconds(run.started);
      setAttribute(node, 'data-state', run.state);
      setText(cells.channel, String(run.channel));
      setText(cells.program, run.program ? visible(run.program) : text.noName);
      setText(cells.started, moment(milliseconds(run.started) - app.clockOffset(), Date.now()));
      setText(cells.took, run.ended ? duration(ran) : age(ran));
      setText(cells.error, run.error ? String(run.error) : words.services.noValue);
      setText(cells.parts, run.parts === undefined ? words.services.noValue : number(run.parts));
      const fresh = run.state + run.detail + run.replayed;
      if (node.dataset.shown !== fresh) {
        node.dataset.shown = fresh;
        replace(cells.outcome, mark(outcomes[run.state] ?? outcomes.unknown, text.outcomes[run.state] ?? run.state), replayed(run.replayed),
          run.detail && explained(messageOf(run, 'detail'), 'detail'));
      }
    },
  };
}

export function dataView(app, query) {
  let machine = query.get('machine') ?? '';
  let span = spans.includes(Number(query.get('span'))) ? Number(query.get('span')) : spans[2];
  let chosen = query.has('show') ? query.getAll('show').filter(Boolean).slice(0, most) : null;
  /** The time that a reader selected with the mouse, by the server's clock; null for the last minutes. */
  let zoom = /^\d+-\d+$/.test(query.get('zoom') ?? '') ? query.get('zoom').split('-').map(Number) : null;
  let filter = '';
  let samples = [];
  let runs = [];
  let machines = [];
  let isAsking = false;
  const lines = new Map();
  const timers = new Set();

  const machineChooser = chooser(words.calls.machine, machine, (value) => choose({ machine: value }), '');
  const spanChooser = chooser(text.span, String(span), (value) => choose({ span: Number(value) }), '');
  spanChooser.show(spans.map((each) => [String(each), text.minutes(each / 60)]));
  const search = element('input', { type: 'search', oninput: () => { filter = search.value.toLowerCase(); drawTables(); } });
  const whole = element('button', { type: 'button', onclick: () => zoomTo(null) }, text.whole);
  const status = element('p', { class: 'list-status', role: 'status' });
  const bands = element('div', { class: 'bands' });
  const plots = element('div', { class: 'lines' });
  const values = element('tbody');
  const table = element('tbody');
  const noValues = element('p', { class: 'empty' });
  const noRuns = element('p', { class: 'empty' }, text.noRuns);
  const part = (title, columns, names, body, empty) => element('section', { class: 'data-part' }, element('h2', {}, title),
    scrolling(title, element('table', { class: 'data-table' }, element('caption', { class: 'for-readers' }, title), tableHead(columns, names), body)), empty);
  const node = element('div', { class: 'data-view' }, element('h1', { tabindex: '-1' }, text.title),
    element('form', { class: 'filter', 'aria-label': text.choice, onsubmit: (event) => event.preventDefault() },
      machineChooser.node, spanChooser.node, element('label', { class: 'data-search' }, element('span', {}, text.search), search), whole, status),
    bands, plots,
    part(text.programs, runColumns, text.runColumns, table, noRuns),
    part(text.values, ['variable', 'value', 'quality', 'read', 'group', 'every'], text.columns, values, noValues));
  const shownLines = new Keyed(plots, (datum) => lineCard(app, datum.line.id, datum.line.now?.type, (from, to) => zoomTo([from, to].map((time) => Math.round(time + app.clockOffset())))));
  const shownBands = new Keyed(bands, band);
  const rows = new Keyed(values, () => variableRow(tick));
  const runRows = new Keyed(table, () => runRow(app));

  /** Puts the choice into the address without rebuilding the view. */
  function keep() {
    const wanted = new URLSearchParams({ machine, span, ...(zoom ? { zoom: zoom.join('-') } : {}) });
    for (const id of chosen ?? []) {
      wanted.append('show', id);
    }
    if (chosen?.length === 0) {
      wanted.append('show', '');
    }
    history.replaceState(null, '', `#/data?${wanted}`);
  }

  function zoomTo(wanted) {
    zoom = wanted;
    keep();
    draw();
  }

  function choose(change) {
    if ('machine' in change) {
      machine = change.machine;
      chosen = null;
      samples = [];
      runs = [];
      lines.clear();
    }
    span = change.span ?? span;
    zoom = null;
    keep();
    askTables();
    askLines();
  }

  function tick(id, on) {
    chosen = on ? [...chosen ?? [], id] : (chosen ?? []).filter((each) => each !== id);
    const isTooMuch = chosen.length > most;
    chosen = chosen.slice(0, most);
    setText(status, isTooMuch ? text.tooMany(most) : '');
    keep();
    drawTables();
    askLines();
  }

  async function askTables() {
    if (document.hidden || app.model.isLost) {
      return;
    }
    const asked = machine;
    const [names, data, programs] = await Promise.all([get(['data', 'machines']),
      ...(asked === '' ? [] : [get(['data'], { machine: asked, elements: 16 }), get(['programs', 'runs'], { machine: asked, limit: mostRuns })])]).catch(() => []);
    if (!names || !node.isConnected || asked !== machine) {
      return;
    }
    machines = names.sort(byName);
    if (machine === '') {
      if (machines.length > 0) {
        [machine] = machines;
        machineChooser.choose(machine);
        askTables();
      }
      return;
    }
    samples = data;
    ({ runs } = programs);
    const all = variablesOf(samples);
    const good = all.filter(({ value }) => value.quality === 'good' && isNumber(value)).slice(0, first).map(({ id }) => id);
    // A page may be opened before the first good value.
    if (chosen === null && good.length > 0) {
      chosen = good;
      askLines();
    }
    drawTables();
  }

  async function askLines() {
    if (isAsking || document.hidden || app.model.isLost || !chosen?.length) {
      draw();
      return;
    }
    const asked = machine;
    isAsking = true;
    const wanted = chosen.map((id) => {
      const line = lines.get(id) ?? new Line(id);
      lines.set(id, line);
      return line;
    });
    const answer = await get(['data', 'history'], [['machine', machine], ...wanted.flatMap((line) => [['variable', line.id], ['since', line.ask()]])]).catch(() => null);
    isAsking = false;
    for (const series of asked === machine ? answer?.series ?? [] : []) {
      lines.get(series.variable)?.take(series);
    }
    for (const line of lines.values()) {
      line.forget(app.now() - spans.at(-1) * 1000);
    }
    draw();
  }

  function draw() {
    if (!node.isConnected) {
      return;
    }
    const now = app.now();
    const [from, to] = zoom ?? [now - span * 1000, now];
    const offset = app.clockOffset();
    whole.hidden = zoom === null;
    shownLines.show((chosen ?? []).filter((id) => lines.get(id)?.now).map((id) => ({ line: lines.get(id), from, to, now, offset })), ({ line }) => line.id);
    const channels = [...new Set(runs.map((run) => run.channel))].sort((a, b) => a - b);
    shownBands.show(channels.map((channel) => ({ channel, runs: runs.filter((run) => run.channel === channel), from, to, now })), ({ channel }) => channel);
  }

  function drawTables() {
    const now = app.now();
    machineChooser.show(machines.map((name) => [name, visible(name)]));
    machineChooser.node.hidden = machines.length < 2;
    const all = variablesOf(samples);
    const some = all.filter(({ id }) => id.toLowerCase().includes(filter));
    rows.show(some.map((variable) => ({ variable, isChosen: chosen?.includes(variable.id) ?? false, now })), ({ variable }) => variable.id);
    const left = app.model.totals?.data_left_out ?? 0;
    setText(noValues, left > 0 ? text.leftOut(left) : all.length === 0 ? text.none : some.length === 0 ? text.noneFits : '');
    runRows.show(runs.map((run) => ({ run, now })), ({ run }) => `${run.channel} ${beginOf(run)}`);
    noRuns.hidden = runs.length > 0;
    draw();
  }

  const every = (act, ms) => timers.add(setInterval(act, ms));
  return {
    node,
    isData: true,
    title: () => text.title,
    update() {},
    enter() {
      askTables();
      askLines();
      every(askLines, lineMs);
      every(askTables, tableMs);
    },
    leave() {
      timers.forEach(clearInterval);
    },
  };
}
