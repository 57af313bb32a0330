// One thing that needs a person: where, what, since when, why, what to do, who.
import { concernName, isOfProgram } from '../attention.js';
import { element, setAttribute, setText, slot } from '../dom.js';
import { age, clock, moment } from '../time.js';
import { words } from '../words.js';
import { reasonOf, said, stateMark, visible } from './marks.js';

/** The command lines that do what the advice says. */
function commandsOf(concern) {
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
  const why = element('div', { class: 'concern-why' });
  const todo = element('div', { class: 'concern-advice' });
  const buttons = element('div', { class: 'buttons' });
  const terminal = element('div', { class: 'at-terminal' });
  const call = element('dl', { class: 'facts concern-call' });
  const body = element('div', { class: 'concern-body' }, why, element('div', { class: 'concern-todo' }, todo, buttons, terminal), call);
  const node = element('article', { class: 'concern' },
    element('div', { class: 'concern-head' }, mark.node, element('div', { class: 'concern-where' }, name, channels),
      element('div', { class: 'concern-when' }, lasting, since)),
    body);
  const showWhy = slot(why);
  const showTodo = slot(todo);
  const showButtons = slot(buttons);
  const showTerminal = slot(terminal);
  const showCall = slot(call);
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
      const mayAct = (concern.kind === 'held' || concern.kind === 'stuck') && channel.call;
      const isStranded = concern.kind === 'held' && channel.instances === 0;
      showWhy([concern.kind, concern.reason, concern.gone, concern.since, isStranded], () => whyOf(app, concern, isStranded));
      showTodo([concern.kind, concern.todo, concern.gone, concern.channels[0]?.machine], () => todoOf(concern));
      showButtons([mayAct, app.session.describe()], () => (mayAct ? app.session.buttonsFor(channel) : []));
      buttons.hidden = !buttons.firstChild;
      const commands = buttons.hidden ? commandsOf(concern) : [];
      showTerminal(commands, () => commands.length > 0 && [element('span', { class: 'label' }, words.command),
        commands.map((command) => element('code', {}, command))]);
      terminal.hidden = commands.length === 0;
      const facts = concern.channels.length === 1 ? callFacts(channel, concern.kind) : [];
      showCall([concern.kind, channel.call, channel.attempt, channel.service, channel.uuid, channel.request, channel.name, channel.host, isOfProgram(concern.kind) && channel.program],
        () => facts.map(([term, value]) => element('div', {}, element('dt', {}, term), element('dd', {}, value))));
      call.hidden = facts.length === 0;
    },
  };
}

function whyOf(app, concern, isStranded) {
  const advice = words.advice[concern.kind];
  return [
    advice && element('p', { class: 'concern-means' }, concern.gone
      ? words.plant.goneGateway(clock(concern.since - app.clockOffset()), visible(concern.gone.host), concern.gone.pid) : advice.means),
    reasonOf(concern.reason),
    isStranded && element('p', { class: 'concern-means' }, words.plant.noInstance),
  ];
}

function todoOf(concern) {
  const advice = words.advice[concern.kind];
  const isQueue = concern.kind === 'unserved' && concern.channels[0]?.machine.includes('.');
  const todo = concern.gone ? words.plant.restartGateway(visible(concern.gone.host)) : isQueue ? advice?.todoOfQueue : advice?.todo;
  const known = words.reason(concern.todo ?? '');
  return advice && [
    element('p', { class: 'who' }, element('span', { class: 'label' }, words.plant.who), advice.who),
    element('p', { class: 'todo' }, element('span', { class: 'label' }, words.plant.todo),
      known ? visible(known) : concern.todo ? element('span', { lang: 'en' }, visible(concern.todo)) : todo),
  ];
}
