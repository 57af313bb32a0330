// The server's events, the newest first.
import { element, Keyed, setAttribute, setText, visible } from '../dom.js';
import { milliseconds, moment } from '../time.js';
import { messageOf } from '../texts/sentences.js';
import { words } from '../words.js';
import { inReadersLanguage } from './marks.js';

const text = words.events;
const levels = { 'instance ended': 'look', 'instance silent': 'look', 'process gone': 'look', 'gateway silent': 'act', 'last instance ended': 'act', 'last instance silent': 'act', 'gateway gone': 'act', 'link down': 'act', 'program aborted': 'act', 'call held': 'act', problem: 'act' };

/** An event as a sentence; `model` has the names of UUIDs. */
function sentenceOf(event, kind, model) {
  const machines = event.machines ?? [];
  return visible(text[kind]?.({
    name: inReadersLanguage(messageOf(event, 'name')) || model.serviceName(event.uuid) || words.services.nameless,
    where: event.pid ? `${event.host}:${event.pid}` : event.host,
    machines: machines.join(', '),
    channel: `${machines[0]}/${event.channel}`,
    service: model.serviceName(event.uuid),
    error: event.error,
    text: inReadersLanguage(messageOf(event, 'text')),
  }) ?? kind);
}

const targetOf = (event) => (event.call ? `#/calls/${encodeURIComponent(event.call)}` : event.uuid ? `#/services/${encodeURIComponent(event.uuid)}`
  : event.channel ? `#/calls?machine=${encodeURIComponent(event.machines[0])}&channel=${event.channel}` : null);

function row(app) {
  const time = element('time', { class: 'event-time' });
  const what = element('a', { class: 'event-what' });
  const node = element('li', {}, time, what);
  return {
    node,
    update(event) {
      const kind = event.last ? `last ${event.kind}` : event.kind;
      setAttribute(node, 'data-event', event.kind);
      setAttribute(node, 'data-level', levels[kind] ?? 'fine');
      setText(time, moment(milliseconds(event.time) - app.clockOffset(), Date.now()));
      setText(what, sentenceOf(event, kind, app.model));
      setAttribute(what, 'href', targetOf(event));
      setAttribute(what, 'title', visible(event.text ?? '') || null);
    },
  };
}

export function eventsList(app, few) {
  const list = element('ul', { class: 'events' });
  const empty = element('p', { class: 'empty', hidden: true }, text.none);
  const more = element('button', { type: 'button', class: 'panel-more', hidden: true, onclick: () => { isLong = true; app.changed(); } });
  const since = element('p', { class: 'panel-note' });
  const node = element('section', { class: 'panel', 'aria-label': text.title }, element('h2', {}, text.title), list, empty, more, since);
  const rows = new Keyed(list, () => row(app));
  let isLong = false;
  return {
    node,
    update(model) {
      const shown = isLong ? model.events : model.events.slice(0, few);
      rows.show(shown, (event) => event.number);
      list.hidden = model.events.length === 0;
      empty.hidden = model.events.length > 0;
      more.hidden = shown.length === model.events.length;
      setText(more, text.more(model.events.length - shown.length));
      setText(since, model.about ? text.since(moment(milliseconds(model.about.started) - app.clockOffset(), Date.now())) : '');
    },
  };
}
