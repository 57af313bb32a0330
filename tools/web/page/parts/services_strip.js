// A row for each service, those with trouble first.
import { element, Keyed, replace, setAttribute, setText } from '../dom.js';
import { byTrouble } from '../model.js';
import { shape } from '../shapes.js';
import { duration } from '../time.js';
import { number, perSecond, words } from '../words.js';

const columns = ['name', 'instances', 'busy', 'rate', 'p50', 'errors'];
const text = words.plant;

/** A small square for each instance, filled by its load; { node, update(group) }. */
export function instanceSquares() {
  const node = element('span', { class: 'squares' });
  let shown = '';
  return {
    node,
    update(group) {
      const here = group.instances.filter((service) => service.goneAt === undefined);
      const kinds = here.map((service) => (service.draining ? 'draining' : service.running >= service.concurrency ? 'busy' : 'ready'));
      if (kinds.join() !== shown || !node.firstChild) {
        shown = kinds.join();
        replace(node, element('span', { class: here.length > 0 && here.length <= 6 ? 'for-readers' : 'squares-count' }, String(here.length)),
          here.length <= 6 && kinds.map((kind) => element('i', { class: 'square', 'data-state': kind, 'aria-hidden': 'true' })));
      }
    },
  };
}

/** A share as a bar and a number; { node, update(share) }. */
export function busyBar() {
  const bar = element('span', { class: 'load-bar' });
  const inWords = element('span', { class: 'load-words' });
  const node = element('span', { class: 'load' }, element('span', { class: 'load-track' }, bar), inWords);
  return {
    node,
    update(share) {
      const percent = share === undefined ? NaN : Math.round(share * 100);
      bar.style.width = `${percent || 0}%`;
      setAttribute(node, 'data-unknown', !Number.isFinite(percent));
      setAttribute(node, 'data-level', percent >= 90 ? 'look' : 'fine');
      setText(inWords, Number.isFinite(percent) ? text.busy(percent) : words.services.noValue);
    },
  };
}

function row() {
  const cells = Object.fromEntries(columns.map((name) => [name, element(name === 'name' ? 'th' : 'td', { class: `cell-${name}`, scope: name === 'name' ? 'row' : null })]));
  const icon = element('span', { class: 'strip-shape' });
  const link = element('a', {});
  const squares = instanceSquares();
  const busy = busyBar();
  cells.name.append(link, icon);
  cells.instances.append(squares.node);
  cells.busy.append(busy.node);
  const node = element('tr', {}, Object.values(cells));
  let level = '';
  return {
    node,
    update({ group, load }) {
      const fresh = group.level === 'fine' && load.errors > 0 ? 'look' : group.level;
      if (fresh !== level) {
        level = fresh;
        setAttribute(node, 'data-level', level);
        replace(icon, level !== 'fine' && shape(level === 'act' ? 'down' : 'look'));
      }
      setAttribute(node, 'data-uuid', group.uuid);
      setText(link, group.name || group.uuid);
      setAttribute(link, 'href', `#/services/${encodeURIComponent(group.uuid)}`);
      setAttribute(link, 'title', group.uuid);
      squares.update(group);
      busy.update(load.busy);
      setText(cells.rate, group.here > 0 ? perSecond(load.rate) : words.services.noValue);
      setText(cells.p50, duration(load.p50));
      setText(cells.errors, group.here > 0 ? number(load.errors) : words.services.noValue);
    },
  };
}

export function servicesStrip(most) {
  const body = element('tbody');
  const table = element('table', { class: 'strip' }, element('thead', {}, element('tr', {},
    columns.map((name) => element('th', { scope: 'col', class: `cell-${name}` }, text.serviceColumns[name])))), body);
  const more = element('a', { class: 'panel-more', href: '#/services', hidden: true });
  const empty = element('p', { class: 'empty', hidden: true });
  const node = element('section', { class: 'panel', 'aria-label': text.services }, element('h2', {}, text.services), table, empty, more);
  const rows = new Keyed(body, row);
  return {
    node,
    update(groups, none) {
      const all = byTrouble(groups);
      rows.show(all.slice(0, most), ({ group }) => group.uuid);
      table.hidden = all.length === 0;
      empty.hidden = all.length > 0;
      setText(empty, none);
      more.hidden = all.length <= most;
      setText(more, text.allServices(all.length - most));
    },
  };
}
