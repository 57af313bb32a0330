// The frame of the page: views, connection, updates.
import { worstOf } from './concerns.js';
import { element, replace, setAttribute, setText, visible } from './dom.js';
import { Model } from './model.js';
import { shape } from './shapes.js';
import { listen } from './stream.js';
import { age, clock } from './time.js';
import { language, words } from './words.js';
import { makeSession } from './session.js';
import { placeholder } from './parts/marks.js';
import { plantView } from './views/plant.js';

const parameters = new URLSearchParams(location.search);
const themes = ['auto', 'light', 'dark'];
const isDark = matchMedia('(prefers-color-scheme: dark)');
/** On a wall, messages close by themselves. */
const wallNoticeMs = 60_000;

const app = {
  model: new Model(),
  isWall: parameters.has('wall'),
  now: () => app.model.now(Date.now()),
  /** Server time minus browser time: clocks on the page are those of the reader. */
  clockOffset: () => app.model.offset,
  changed: () => schedule(),
};
app.session = makeSession(app);

// --- the frame

const main = element('main', { id: 'content', tabindex: '-1' });
const fabric = element('span', { class: 'fabric' });
const liveText = element('span', { class: 'live-text' });
const live = element('p', { class: 'live', role: 'status' }, element('span', { class: 'live-dot', 'aria-hidden': 'true' }), liveText);
const time = element('time', { class: 'clock' });
const lost = element('div', { class: 'lost', role: 'alert', hidden: true });
const again = element('div', { class: 'again', role: 'status', hidden: true });
const tabs = new Map();
const nav = element('nav', { class: 'tabs', 'aria-label': words.tabsLabel }, ['plant', 'services', 'calls', 'data', 'recordings', 'doctor'].map((name) => {
  const count = element('span', { class: 'tab-count', hidden: true });
  const link = element('a', { href: `#/${name}`, 'data-tab': name }, element('span', {}, words.tabs[name]), count);
  tabs.set(name, { link, count });
  return link;
}));
const account = element('div', { class: 'account' });
const theme = element('select', { 'aria-label': words.theme.label, onchange: () => chooseTheme(theme.value) },
  themes.map((name) => element('option', { value: name }, words.theme[name])));
const wallLink = element('a', { class: 'wall-link', href: '/?wall', title: words.wallTitle }, words.wall);

function build() {
  document.documentElement.lang = language;
  document.documentElement.classList.toggle('wall', app.isWall);
  document.body.replaceChildren(
    element('a', { class: 'skip', href: '#content', onclick: (event) => { event.preventDefault(); main.focus(); } }, words.skip),
    element('header', { class: 'top' },
      element('p', { class: 'brand' }, element('img', { src: '/icon.svg', alt: '', width: 28, height: 28 }), element('strong', {}, words.title), ' ', fabric),
      app.isWall ? element('a', { class: 'wall-link', href: '/#/plant' }, words.wallLeave) : nav,
      element('div', { class: 'side' }, live, time, !app.isWall && account, !app.isWall && theme, !app.isWall && wallLink)),
    lost, again, main);
}

function chooseTheme(name) {
  const known = themes.includes(name) ? name : 'auto';
  theme.value = known;
  try {
    localStorage.setItem('theme', known);
  } catch {
    // Without storage the choice is lost on reload.
  }
  setAttribute(document.documentElement, 'data-theme', known === 'auto' ? (isDark.matches ? 'dark' : 'light') : known);
}

function storedTheme() {
  try {
    return parameters.get('theme') ?? localStorage.getItem('theme') ?? 'auto';
  } catch {
    return parameters.get('theme') ?? 'auto';
  }
}

// --- which view

let view = null;

function route() {
  const [path, query = ''] = location.hash.replace(/^#\/?/, '').split('?');
  const asked = new URLSearchParams(query);
  const parts = path.split('/').map((part) => {
    try {
      return decodeURIComponent(part);
    } catch {
      return part;
    }
  });
  // The wall shows the plant, or chosen lines.
  const [tab, id, inner] = app.isWall && parts[0] !== 'data' ? ['plant'] : parts;
  switch (tab) {
    case 'services':
      return { tab, make: async () => (await import('./views/services.js')).servicesView(app, id, asked) };
    case 'calls':
      return { tab, make: async () => (id ? callOf(id, ['calls', id], { href: '#/calls', text: words.call.back })
        : (await import('./views/calls.js')).callsView(app, asked)) };
    case 'recordings':
      return { tab, make: async () => {
        if (inner) {
          return callOf(inner, ['recordings', id, 'calls', inner], { href: `#/recordings/${encodeURIComponent(id)}`, text: id });
        }
        const { recordingsView, recordingView } = await import('./views/recordings.js');
        return id ? recordingView(app, id, asked) : recordingsView(app);
      } };
    case 'data':
      return { tab, make: async () => (await import('./views/data.js')).dataView(app, asked) };
    case 'doctor':
      return { tab, make: async () => (await import('./views/doctor.js')).doctorView(app) };
    default:
      return { tab: 'plant', make: async () => plantView(app, asked) };
  }
}

const callOf = async (id, path, back) => (await import('./views/call.js')).callView(app, id, path, back);

/** Replaces a view that could not be loaded. */
const missingView = () => ({ node: placeholder('failure', words.failure.title, words.failure.unreachable), title: () => words.failure.title, update() {} });

let latest = null;

/** Views are loaded when they are first shown, except the first one. */
async function showRoute(isFirst) {
  const next = route();
  latest = next;
  const made = await next.make().catch(missingView);
  // The reader may have chosen another view in the meantime.
  if (latest !== next) {
    return;
  }
  view?.leave?.();
  view = made;
  for (const [name, { link }] of tabs) {
    setAttribute(link, 'aria-current', name === next.tab ? 'page' : null);
  }
  setAttribute(document.body, 'data-tab', next.tab);
  replace(main, view.node);
  update();
  view.enter?.();
  if (!isFirst) {
    scrollTo(0, 0);
    // For screen readers: announces the new view.
    main.querySelector('h1')?.focus({ preventScroll: true });
  }
}

// --- what changes

/** How long a pressed pointer holds the page: nothing moves under it, so that a click ends where it began. */
const longestPressMs = 5000;
let pressedSince = -Infinity;
addEventListener('pointerdown', () => { pressedSince = performance.now(); }, true);
for (const end of ['pointerup', 'pointercancel', 'blur']) {
  addEventListener(end, () => { pressedSince = -Infinity; schedule(); }, true);
}

let scheduled = false;

/** Shows all changes of one frame together. */
function schedule() {
  if (!scheduled) {
    scheduled = true;
    requestAnimationFrame(() => {
      scheduled = false;
      update();
    });
  }
}

/** Shows the number of causes that need attention in the window title and at the tab. */
function tellState(level, count) {
  const { count: counter } = tabs.get('plant');
  counter.hidden = !(count > 0);
  setText(counter, String(count));
  const mark = level === 'act' ? `(${count}) ` : level === 'unknown' ? '(?) ' : '';
  const title = visible(`${mark}${view?.title() ?? ''} – ${words.title}`);
  if (document.title !== title) {
    document.title = title;
  }
}

function update() {
  if (performance.now() - pressedSince < longestPressMs) {
    return;
  }
  const { model } = app;
  updateConnection();
  // The tab shows it in every view.
  const { level, count } = worstOf(model.concerns);
  tellState(model.about !== null && !model.isLost ? level : 'unknown', count);
  tabs.get('recordings').link.hidden = !model.about?.recordings;
  tabs.get('data').link.hidden = !(model.totals?.data_groups > 0 || model.totals?.program_channels > 0 || view?.isData);
  updateAccount();
  view?.update();
  if (model.about !== null) {
    document.documentElement.dataset.ready = 'true';
  }
}

function updateConnection() {
  const { model } = app;
  const isKnown = model.about !== null;
  setText(fabric, isKnown ? model.about.fabric : '');
  const now = new Date().toTimeString();
  setText(time, now.slice(0, 8));
  // The zone of all times of the page.
  time.title = now.slice(9);
  setText(liveText, !isKnown || model.isLost ? words.link.connecting : words.link.live);
  setAttribute(live, 'data-live', isKnown && !model.isLost);
  setAttribute(document.body, 'data-lost', model.isLost);
  if (lost.hidden === model.isLost) {
    lost.hidden = !model.isLost;
    replace(lost, model.isLost && [shape('unknown'), element('div', {},
      element('p', { class: 'lost-title' }, isKnown ? words.link.lost(clock(model.lastHeard)) : words.link.never),
      element('p', {}, isKnown ? words.link.lostWhat : words.link.neverWhat))]);
  }
  if (app.isWall && model.gap && Date.now() - model.gap.to > wallNoticeMs) {
    model.gap = null;
  }
  const { gap } = model;
  const wanted = gap && !model.isLost ? `${gap.from}-${gap.to}` : '';
  if (again.dataset.gap !== wanted) {
    again.dataset.gap = wanted;
    again.hidden = wanted === '';
    replace(again, wanted !== '' && [
      element('p', {}, (gap.otherServer ? words.link.otherServer : words.link.again)(clock(gap.from), clock(gap.to), age(gap.to - gap.from))),
      element('button', { type: 'button', onclick: () => { model.gap = null; update(); } }, words.link.dismiss)]);
  }
}

let shownAccount = '';

function updateAccount() {
  const fresh = JSON.stringify(app.session.describe());
  if (fresh === shownAccount) {
    return;
  }
  shownAccount = fresh;
  replace(account, app.session.actions && (app.session.user
    ? [element('span', { class: 'account-user', title: words.actions.loggedIn(app.session.user) }, app.session.user),
      element('button', { type: 'button', onclick: () => app.session.logout() }, words.actions.logout)]
    : element('button', { type: 'button', onclick: () => app.session.login() }, words.actions.login)));
}

build();
chooseTheme(storedTheme());
showRoute(true);
addEventListener('hashchange', () => showRoute(false));
isDark.addEventListener('change', () => chooseTheme(theme.value));
setInterval(update, 1000);
listen({
  snapshot(data) {
    const isNew = app.model.about?.started !== data.about.started;
    app.model.takeSnapshot(data, Date.now());
    if (isNew) {
      app.session.refresh();
    }
    schedule();
  },
  changes(data) {
    app.model.takeChanges(data, Date.now());
    schedule();
  },
  lost() {
    app.model.lose(Date.now());
    update();
  },
  bye() {
    app.model.lose(Date.now());
    update();
  },
});
