// The first view: a banner, a card for each cause that needs attention, then machines, services and events.
import { concernName, headlineOf, worstOf } from '../concerns.js';
import { element, Keyed, replace, setAttribute, setText } from '../dom.js';
import { isService, machinesWith } from '../search.js';
import { shape } from '../shapes.js';
import { age, milliseconds } from '../time.js';
import { number, perSecond, words } from '../words.js';
import { concernCard } from '../parts/concern_card.js';
import { addressOf, inReadersLanguage, searchField } from '../parts/marks.js';
import { eventsList } from '../parts/events_list.js';
import { machineTile } from '../parts/machine_tile.js';
import { servicesStrip } from '../parts/services_strip.js';

/** A wall cannot scroll: so many concerns are shown, the others are counted. */
const concernsOnWall = 5;
/** Shown at first; the rest is one click away. */
const servicesShown = 8;
const eventsShown = 12;
/** Fewer machines are found without a filter. */
const machinesWithoutFilter = 12;

/** The density of tiles by the number of channels. */
function densityOf(count) {
  return count > 64 ? 'dense' : count > 16 ? 'compact' : 'roomy';
}

function headline() {
  const icon = element('span', { class: 'headline-shape' });
  const text = element('h1', { tabindex: '-1' });
  const lasting = element('p', { class: 'headline-age' });
  const sum = element('p', { class: 'headline-sum' });
  const node = element('header', { class: 'headline' }, icon, text, lasting, sum);
  let drawn = '';
  return {
    node,
    update(level, title, longest, facts) {
      if (drawn !== level) {
        drawn = level;
        replace(icon, shape({ act: 'look', look: 'look', fine: 'well' }[level] ?? 'unknown'));
        setAttribute(node, 'data-level', level);
      }
      setText(text, title);
      setText(lasting, longest);
      setText(sum, facts);
    },
  };
}

/** The number of subjects that need attention, with their kind if all are of one kind. */
function titleOf(model, isEmpty) {
  const text = words.plant;
  if (model.isLost || model.about === null) {
    return text.unknown;
  }
  if (isEmpty && model.concerns.every(({ kind }) => kind === 'no gateway')) {
    return text.nobody;
  }
  const { word, count } = headlineOf(model.concerns);
  return typeof text[word] === 'string' ? text[word] : text[word](count);
}

/** Links and channels without a concern, calls and errors. */
function factsOf(model, plant) {
  const text = words.plant;
  const linked = plant.filter((machine) => machine.links.some((link) => link.connected)).length;
  const withLinks = plant.filter((machine) => machine.links.length > 0).length;
  const channels = plant.flatMap((machine) => machine.channels);
  const ok = channels.filter(({ view }) => view.level === 'fine').length;
  const errors = model.totals?.errors_last_minute ?? 0;
  return [text.links(linked, withLinks), text.channelsOk(ok, channels.length), text.rate(perSecond(model.totals?.calls_per_second ?? 0)),
    errors > 0 && text.errorsPerMinute(number(errors))].filter(Boolean)
    // No line break within a fact.
    .map((fact) => fact.replaceAll(' ', '\u00a0')).join(' · ');
}

/** The query has `text`: machines, channels and services with it are shown, and all problems. A wall shows all. */
export function plantView(app, query) {
  /** What the wall shows, and the size of its screen. */
  let measured = '';
  let wanted = app.isWall ? '' : query.get('text') ?? '';
  const search = searchField(words.plant.search, wanted, (value) => {
    wanted = value;
    history.replaceState(null, '', addressOf('plant', { text: value }));
    app.changed();
  });
  const form = element('form', { class: 'filter', role: 'search', 'aria-label': words.plant.machines, hidden: true, onsubmit: (event) => event.preventDefault() }, search.node);
  const head = headline();
  const attention = element('div', { class: 'concerns' });
  const more = element('p', { class: 'concerns-more', hidden: true });
  const attentionPart = element('section', { class: 'attention', 'aria-label': words.plant.attention, hidden: true }, attention, more);
  const grid = element('div', { class: 'machines' });
  const empty = element('p', { class: 'empty', hidden: true });
  const services = servicesStrip(servicesShown);
  const events = eventsList(app, eventsShown);
  const machinesPart = element('section', { class: 'machines-part', 'aria-label': words.plant.machines }, element('h2', {}, words.plant.machines), grid, empty);
  const board = element('div', { class: 'board' }, machinesPart, !app.isWall && element('div', { class: 'board-side' }, services.node, events.node));
  const node = element('div', { class: 'plant' }, head.node, attentionPart, form, board);
  const cards = new Keyed(attention, () => concernCard(app));
  const tiles = new Keyed(grid, () => machineTile());

  return {
    node,
    title: () => words.tabs.plant,
    leave: search.stop,
    update() {
      const { model } = app;
      const now = app.now();
      const plant = model.plant();
      // An empty page says the same in its place.
      const concerns = model.concerns.filter(({ kind }) => plant.length > 0 || kind !== 'no gateway');
      const { level } = worstOf(concerns);
      const isKnown = model.about !== null && !model.isLost;
      const times = concerns.filter((concern) => concern.level === level).map((concern) => milliseconds(concern.since)).filter(Number.isFinite);
      const longest = times.length > 0 && isKnown ? words.plant[times.length > 1 ? 'longest' : 'lasting'](age(now - Math.min(...times))) : '';
      head.update(isKnown && (plant.length > 0 || concerns.length > 0) ? level : 'unknown', titleOf(model, plant.length === 0), longest,
        model.about === null || plant.length === 0 ? '' : factsOf(model, plant));
      const shown = app.isWall ? concerns.slice(0, concernsOnWall) : concerns;
      attentionPart.hidden = concerns.length === 0;
      setAttribute(attentionPart, 'data-crowd', concerns.length > 3 ? 'many' : 'few');
      cards.show(shown.map((concern) => ({ concern, now })), ({ concern }) => `${concern.cause}\u0000${concern.level}`);
      more.hidden = shown.length === concerns.length;
      setText(more, words.plant.more(concerns.length - shown.length) + (more.hidden ? ''
        : `: ${concerns.slice(concernsOnWall).map((concern) => inReadersLanguage(concernName(concern))).join(', ')}`));
      const fitting = machinesWith(plant, wanted);
      form.hidden = app.isWall || (plant.length <= machinesWithoutFilter && !wanted);
      // On a wall, concerns take the room of machines without one.
      const density = app.isWall && concerns.length > 0 ? 'strip' : densityOf(fitting.flatMap(({ channels }) => channels).length);
      setAttribute(grid, 'data-density', density);
      setAttribute(board, 'data-density', density);
      setAttribute(grid, 'data-few', fitting.length <= 8);
      setAttribute(grid, 'data-programs', plant.some((machine) => machine.channels.some((channel) => channel.program)));
      empty.hidden = fitting.length > 0 || model.about === null;
      setText(empty, plant.length > 0 ? words.plant.noneFits : words.plant.nobodyWhat);
      tiles.show(fitting.map((machine) => ({ machine, now, density })), ({ machine }) => machine.name);
      if (app.isWall) {
        const names = fitting.map(({ name, channels }) => [name, channels.map(({ service, program }) => [service, program?.name])]);
        const fresh = JSON.stringify([names, density, innerWidth, innerHeight]);
        if (fresh !== measured) {
          measured = fresh;
          setAttribute(grid, 'data-full', true);
        }
        // A wall cannot scroll: names take several lines if there is room.
        if (document.documentElement.scrollHeight > innerHeight) {
          setAttribute(grid, 'data-full', false);
        }
      } else {
        services.update(model.servicesByUuid().filter((group) => isService(group, wanted)), wanted ? words.services.noneFits : words.plant.noServices);
        events.update(model);
      }
    },
  };
}
