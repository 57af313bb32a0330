// The findings of `millrace doctor`: problems first, with what to do.
import { get } from '../api.js';
import { asSentence, explained, placeholder, scrolling, tableHead } from '../parts/marks.js';
import { element, replace, visible } from '../dom.js';
import { shape } from '../shapes.js';
import { messageOf } from '../texts/sentences.js';
import { clock, duration, milliseconds } from '../time.js';
import { words } from '../words.js';

const text = words.doctor;
const level = { problem: 'act', warning: 'look', fine: 'fine' };
const shapeOf = { problem: 'held', warning: 'look', fine: 'well' };

function finding(each) {
  return element('li', { class: 'finding', 'data-level': level[each.severity] },
    element('span', { class: 'result', 'data-level': level[each.severity] }, shape(shapeOf[each.severity]), text.severity[each.severity]),
    element('div', {}, explained(messageOf(each, 'what'), 'finding-what', 'p'),
      each.todo.length > 0 && element('p', { class: 'finding-advice' }, element('span', { class: 'label' }, text.todo),
        each.todo.map((step, i) => [i > 0 && ' ', explained(messageOf(step, 'text'), null, 'span', asSentence)]))));
}

function role(program) {
  const roles = [program.self && text.self, program.gateway && (program.heard ? text.gateway : text.silentGateway),
    program.serves.length > 0 && text.serves(program.serves.map(visible).join(', '))].filter(Boolean);
  return roles.join(', ') || text.looksOn;
}

function programs(found) {
  return scrolling(text.programs,
    element('table', { class: 'programs' }, element('caption', {}, text.programs),
      tableHead(['program', 'host', 'pid', 'address', 'role'], text.columns),
      element('tbody', {}, found.map((program) => element('tr', {},
        element('th', { scope: 'row', 'data-label': text.columns.program }, program.name || '–'),
        element('td', { 'data-label': text.columns.host }, program.host || '–'),
        element('td', { 'data-label': text.columns.pid }, program.pid || '–'),
        element('td', { 'data-label': text.columns.address }, program.addresses),
        element('td', { 'data-label': text.columns.role }, role(program)))))));
}

function headline(found) {
  const problems = found.diagnoses.filter((each) => each.severity === 'problem').length;
  const warnings = found.diagnoses.filter((each) => each.severity === 'warning').length;
  const worst = problems > 0 ? 'act' : warnings > 0 ? 'look' : 'fine';
  return element('p', { class: 'verdict', 'data-level': worst }, shape({ act: 'held', look: 'look', fine: 'well' }[worst]),
    problems > 0 ? text.ill(problems) : warnings > 0 ? text.warnings(warnings) : text.healthy);
}

export function doctorView(app) {
  const content = element('div', { 'aria-live': 'polite' });
  const status = element('span', { class: 'list-status' });
  const again = element('button', { type: 'button', onclick: () => ask() }, text.again);
  const node = element('div', { class: 'doctor' }, element('h1', { tabindex: '-1' }, text.title), element('p', { class: 'doctor-bar' }, again, status), content);
  const order = { problem: 0, warning: 1, fine: 2 };

  async function ask() {
    again.disabled = true;
    replace(status, text.looking);
    try {
      const found = await get(['doctor']);
      const sorted = [...found.diagnoses].sort((a, b) => order[a.severity] - order[b.severity]);
      replace(content, headline(found), element('ul', { class: 'findings' }, sorted.map(finding)),
        element('p', {}, text.fabric(visible(found.fabric), found.domain, visible(found.interface))),
        programs(found.programs),
        found.clocks.length > 0 && element('section', {}, element('h2', {}, text.clocks), element('ul', {},
          found.clocks.map((each) => element('li', {}, text.clock(visible(each.host), duration(each.ahead_ms), duration(each.error_ms)))))));
      replace(status, text.looked(clock(milliseconds(found.time) - app.clockOffset())));
    } catch (problem) {
      replace(content, placeholder('failure', words.failure.title, problem.message));
      replace(status);
    }
    again.disabled = false;
  }
  return { node, title: () => text.title, update() {}, enter: ask };
}
