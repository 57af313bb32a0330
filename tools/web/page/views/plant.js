// The first view: is something wrong, where, since when, who must act. What needs a person comes first and large, then a
// tile for each machine.
import { assess, concernKey, concernName } from '../attention.js';
import { element, Keyed, replace, setAttribute, setText } from '../dom.js';
import { shape } from '../shapes.js';
import { age } from '../time.js';
import { perSecond, words } from '../words.js';
import { concernCard } from '../parts/concern_card.js';
import { machineTile } from '../parts/machine_tile.js';

/** On a wall nobody scrolls: this many concerns are shown, and the rest is counted. */
const concernsOnWall = 4;

/** From how many channels on tiles show less of each. */
function densityOf(count) {
  return count > 64 ? 'dense' : count > 16 ? 'compact' : 'roomy';
}

function headline() {
  const icon = element('span', { class: 'headline-shape' });
  const text = element('span', { class: 'headline-text' });
  const lasting = element('span', { class: 'headline-age' });
  const sum = element('span');
  const node = element('header', { class: 'headline' }, icon,
    element('div', { class: 'headline-words' }, element('h1', { tabindex: '-1' }, text), element('p', { class: 'headline-sum' }, lasting, sum)));
  let drawn = '';
  return {
    node,
    update(level, title, since, total) {
      if (drawn !== level) {
        drawn = level;
        replace(icon, shape({ person: 'held', look: 'look', fine: 'well' }[level] ?? 'unknown'));
        setAttribute(node, 'data-level', level);
      }
      setText(text, title);
      setText(lasting, since);
      setText(sum, total);
    },
  };
}

function titleOf(model, assessment, isEmpty) {
  if (model.isLost || model.about === null) {
    return words.plant.unknown;
  }
  if (isEmpty) {
    return words.plant.nobody;
  }
  const { counts, level } = assessment;
  if (level === 'fine') {
    return words.plant.well;
  }
  if (counts.person > 0) {
    return words.plant.needs(counts.person);
  }
  if (counts.machines > 0) {
    return words.plant.needsMachines(counts.machines);
  }
  return counts.programs > 0 ? words.plant.needsPrograms(counts.programs)
    : counts.look > 0 ? words.plant.look(counts.look) : words.plant.warns;
}

export function plantView(app) {
  const head = headline();
  const attention = element('div', { class: 'concerns' });
  const more = element('p', { class: 'concerns-more', hidden: true });
  const attentionPart = element('section', { class: 'attention', 'aria-label': words.plant.attention, hidden: true }, attention, more);
  const grid = element('div', { class: 'machines' });
  const empty = element('p', { class: 'empty', hidden: true }, words.plant.nobodyWhat);
  const node = element('div', { class: 'plant' }, head.node, attentionPart,
    element('section', { class: 'machines-part', 'aria-label': words.plant.machines }, grid, empty));
  const cards = new Keyed(attention, () => concernCard(app));
  const tiles = new Keyed(grid, () => machineTile());

  return {
    node,
    title: () => words.tabs.plant,
    update() {
      const { model } = app;
      const now = app.now();
      const plant = model.plant();
      const assessment = assess(plant, now, model.notices);
      const { concerns } = assessment;
      const isKnown = model.about !== null && !model.isLost;
      const times = concerns.map((concern) => concern.since).filter(Number.isFinite);
      const since = times.length > 0 && isKnown ? words.plant.longest(age(now - Math.min(...times))) : '';
      head.update(isKnown && plant.length > 0 ? assessment.level : 'unknown', titleOf(model, assessment, plant.length === 0), since,
        model.about === null ? '' : words.plant.sum(plant.length, model.channels.size,
          words.plant.rate(perSecond(model.totals?.calls_per_second ?? 0))));
      const shown = app.isWall ? concerns.slice(0, concernsOnWall) : concerns;
      attentionPart.hidden = concerns.length === 0;
      setAttribute(attentionPart, 'data-crowd', concerns.length > 2 ? 'many' : 'few');
      cards.show(shown.map((concern) => ({ concern, now })), ({ concern }) => concernKey(concern));
      more.hidden = shown.length === concerns.length;
      setText(more, words.plant.more(concerns.length - shown.length) + (more.hidden ? ''
        : `: ${concerns.slice(concernsOnWall).map(concernName).join(', ')}`));
      // On a wall what needs somebody takes the place of what is well.
      const density = app.isWall && concerns.length > 0 ? 'strip' : densityOf(model.channels.size);
      setAttribute(grid, 'data-density', density);
      empty.hidden = plant.length > 0 || model.about === null;
      tiles.show(plant.map((machine) => ({ machine, now, density })), ({ machine }) => machine.name);
    },
  };
}
