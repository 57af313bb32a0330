// One thing that needs a person: where, what, since when, why, what to do, who.
import { concernName, isOfProgram } from '../attention.js';
import { element, replace, setAttribute, setText } from '../dom.js';
import { age, clock, moment } from '../time.js';
import { words } from '../words.js';
import { said, stateMark, visible } from './marks.js';

/** The sentence of a shell that does what the advice says; nothing where there is none. */
function commandOf(concern) {
  const where = concernName(concern);
  return concern.kind === 'held'
    ? [`millrace answer ${quoted(where)} RESPONSE --state N`, `millrace retry ${quoted(where)}`]
    : [];
}

function quoted(word) {
  return /^[\w./-]+$/.test(word) ? word : `'${word.replaceAll("'", "'\\''")}'`;
}

/** What the call of a channel is, in one line of pairs. */
function callFacts(channel, kind) {
  if (isOfProgram(kind)) {
    return [
      channel.program.name && [words.plant.program, visible(channel.program.name)],
      channel.program.error && [words.plant.error, String(channel.program.error)],
    ].filter(Boolean);
  }
  const service = channel.service || channel.uuid;
  return [
    service && [words.plant.service, visible(service)],
    channel.request !== undefined && [words.plant.request, said(channel.request)],
    channel.name && [words.plant.instance, `${visible(channel.name)}${channel.host ? ` @ ${visible(channel.host)}` : ''}`],
    channel.call && [words.plant.call, element('a', { href: `#/calls/${encodeURIComponent(channel.call)}` },
      channel.call, channel.attempt > 1 && ` · ${words.plant.attempt(channel.attempt)}`)],
  ].filter(Boolean);
}

export function concernCard(app) {
  const mark = stateMark('p', 'concern-state');
  const name = element('h2', { class: 'concern-name' });
  const channels = element('p', { class: 'concern-channels', hidden: true });
  const lasting = element('p', { class: 'concern-age' });
  const since = element('p', { class: 'concern-since' });
  const body = element('div', { class: 'concern-body' });
  const node = element('article', { class: 'concern' },
    element('div', { class: 'concern-head' }, mark.node, element('div', { class: 'concern-where' }, name, channels),
      element('div', { class: 'concern-when' }, lasting, since)),
    body);
  let shown = '';
  return {
    node,
    update({ concern, now }) {
      mark.update(concern.kind, concern.level);
      setAttribute(node, 'data-level', concern.level);
      setAttribute(node, 'data-kind', concern.kind);
      setText(name, visible(concernName(concern)));
      setAttribute(name, 'data-long', concernName(concern).length > 9);
      channels.hidden = concern.channels.length < 2;
      setText(channels, channels.hidden ? '' : words.plant.allChannels(concern.channels.length));
      const known = Number.isFinite(concern.since);
      setText(lasting, known ? age(now - concern.since) : '');
      setText(since, known ? words.plant.since(moment(concern.since - app.clockOffset(), Date.now())) : '');
      const channel = concern.channels.length === 1 ? concern.channels[0] : {};
      const fresh = JSON.stringify([concern.kind, concern.reason, concern.todo, concern.gone, concern.since, channel.call, channel.attempt, channel.service, channel.uuid,
        channel.request, channel.name, channel.host, channel.program, channel.instances, app.session.describe()]);
      if (fresh !== shown) {
        shown = fresh;
        replace(body, ...bodyOf(app, concern, channel));
      }
    },
  };
}

/** What a gateway says of it, in the reader's language where the page knows the sentence. */
function reasonOf(reason) {
  const known = words.reason(reason ?? '');
  return reason && (known ? element('p', { class: 'reason' }, visible(known)) : said(reason, { lang: 'en', class: 'said reason' }));
}

function todoOf(concern, advice) {
  if (concern.gone) {
    return words.plant.restartGateway(visible(concern.gone.host));
  }
  return concern.kind === 'unserved' && concern.channels[0]?.machine.includes('.') ? advice.todoOfQueue : advice.todo;
}

function bodyOf(app, concern, channel) {
  const advice = words.advice[concern.kind];
  const isOperators = concern.kind === 'held' || concern.kind === 'stuck';
  const isStranded = concern.kind === 'held' && channel.instances === 0;
  const facts = concern.channels.length === 1 ? callFacts(channel, concern.kind) : [];
  const buttons = isOperators && channel.call ? app.session.buttonsFor(channel) : [];
  const commands = buttons.length === 0 ? commandOf(concern) : [];
  return [
    element('div', { class: 'concern-why' },
      advice && element('p', { class: 'concern-means' }, concern.gone
        ? words.plant.goneGateway(clock(concern.since - app.clockOffset()), visible(concern.gone.host), concern.gone.pid) : advice.means),
      reasonOf(concern.reason),
      isStranded && element('p', { class: 'concern-means' }, words.plant.noInstance)),
    advice && element('div', { class: 'concern-todo' },
      element('p', { class: 'who' }, element('span', { class: 'label' }, words.plant.who), advice.who),
      element('p', { class: 'todo' }, element('span', { class: 'label' }, words.plant.todo), concern.todo ? element('span', { lang: 'en' }, visible(concern.todo)) : todoOf(concern, advice)),
      buttons.length > 0 && element('div', { class: 'buttons' }, buttons),
      commands.length > 0 && element('div', { class: 'at-terminal' }, element('span', { class: 'label' }, words.command),
        commands.map((command) => element('code', {}, command)))),
    facts.length > 0 && element('dl', { class: 'facts concern-call' },
      facts.map(([term, value]) => element('div', {}, element('dt', {}, term), element('dd', {}, value)))),
  ];
}
