// A cause that needs attention, in two or three lines: state, place, time, reason, person in charge, action.
import { acknowledgementOf, concernName, isOfProgram, otherChannels } from '../attention.js';
import { element, setAttribute, setText, slot, visible } from '../dom.js';
import { age, clock, milliseconds, moment } from '../time.js';
import { textOf } from '../texts/sentences.js';
import { words } from '../words.js';
import { reasonOf, said, stateMark } from './marks.js';

/** Command lines for the advice; `flags` name the fabric. */
function commandsOf(concern, flags) {
  const where = quoted(concernName(concern)) + flags;
  return concern.kind === 'held'
    ? [`millrace answer ${where} RESPONSE --state N`, `millrace retry ${where}`]
    : [];
}

function quoted(word) {
  return /^[\w./-]+$/.test(word) ? word : `'${word.replaceAll("'", "'\\''")}'`;
}

/** The subject: service and request, the NC program with its error, or nothing. */
function subjectOf(concern) {
  const [channel] = concern.channels;
  if (!channel || concern.kind === 'gone' || concern.kind === 'link down' || concern.kind === 'journal') {
    return [];
  }
  if (isOfProgram(concern.kind)) {
    const { name, error } = channel.program;
    return [visible(name), error && ` · ${words.plant.errorOf(error)}`];
  }
  return [visible(channel.service || channel.uuid), channel.request !== undefined && [' ', said(channel.request)]];
}

/** The last instance of the service, where it is known. */
function lastInstanceOf(app, concern) {
  const uuid = concern.kind === 'unserved' ? concern.channels[0]?.uuid?.toLowerCase() : undefined;
  return uuid && [...app.model.services.values()].filter((service) => service.uuid === uuid && service.goneAt !== undefined)
    .reduce((last, service) => (last && last.goneAt > service.goneAt ? last : service), null);
}

export function concernCard(app) {
  const mark = stateMark('p', 'concern-state');
  const name = element('h2', { class: 'concern-name' });
  const subject = element('p', { class: 'concern-subject' });
  const lasting = element('p', { class: 'concern-age' });
  const since = element('p', { class: 'concern-since' });
  const why = element('div', { class: 'concern-why' });
  const advice = element('div', { class: 'concern-advice' });
  const others = element('p', { class: 'concern-others', hidden: true });
  const taken = element('p', { class: 'concern-taken', hidden: true });
  const buttons = element('div', { class: 'buttons' });
  const terminal = element('p', { class: 'at-terminal' });
  const call = element('p', { class: 'concern-call' });
  const node = element('article', { class: 'concern' },
    element('div', { class: 'concern-when' }, mark.node, lasting, since),
    element('div', { class: 'concern-where' }, name, subject, others, taken),
    element('div', { class: 'concern-acts' }, buttons, call),
    element('div', { class: 'concern-body' }, why, advice, terminal));
  let wasStranded = false;
  let current = null;
  const showSubject = slot(subject);
  const showWhy = slot(why);
  const showAdvice = slot(advice);
  const showButtons = slot(buttons);
  const showTerminal = slot(terminal);
  const showCall = slot(call);
  return {
    node,
    update({ concern, now }) {
      mark.update(concern.kind === 'trouble' && concern.level === 'look' ? 'warning' : concern.kind, concern.level);
      setAttribute(node, 'data-level', concern.level);
      setAttribute(node, 'data-kind', concern.kind);
      setText(name, concernName(concern));
      const known = Number.isFinite(concern.since);
      setText(lasting, known ? age(now - concern.since) : '');
      setText(since, known ? words.plant.since(moment(concern.since - app.clockOffset(), Date.now())) : '');
      const channel = concern.channels.length === 1 ? concern.channels[0] : {};
      const mayAct = (concern.kind === 'held' || concern.kind === 'stuck') && channel.call;
      const isStranded = concern.kind === 'held' && channel.instances === 0;
      const last = lastInstanceOf(app, concern);
      showSubject([concern.kind, concern.channels[0]?.service, concern.channels[0]?.uuid, concern.channels[0]?.request, isOfProgram(concern.kind) && concern.channels[0].program],
        () => subjectOf(concern));
      // Keeps the buttons below from moving while they are pressed.
      if (wasStranded && !isStranded) {
        why.style.minHeight = `${why.offsetHeight}px`;
      }
      wasStranded = isStranded;
      showWhy([concern.kind, textOf(concern.reason), concern.gone, concern.since, isStranded, last?.instance], () => whyOf(app, concern, isStranded, last));
      showAdvice([concern.kind, textOf(concern.todo), concern.gone, concern.channels[0]?.machine, concern.channels[0]?.service, Boolean(last)], () => adviceOf(concern, last));
      const also = otherChannels(concern);
      others.hidden = also.length === 0;
      setText(others, words.plant.alsoWaiting(visible(also.join(', '))));
      const by = acknowledgementOf(concern, app.model.acknowledged);
      taken.hidden = !by;
      setText(taken, by ? words.plant.taken(visible(by.by), moment(milliseconds(by.time) - app.clockOffset(), Date.now()), visible(by.note)) : '');
      current = concern;
      showButtons([mayAct, by?.by, app.session.describe()], () => [mayAct ? app.session.buttonsFor(channel) : [],
        by?.by === app.session.user && by ? null : app.session.acknowledgeButton(() => current)]);
      buttons.hidden = !buttons.firstChild;
      const acts = buttons.querySelector('[data-action="retry"], [data-action="answer"]') !== null;
      setAttribute(node, 'data-acts', acts);
      const commands = acts ? [] : commandsOf(concern, app.model.about?.flags ?? '');
      showTerminal(commands, () => commands.length > 0 && [element('span', { class: 'label' }, `${words.command}: `),
        commands.map((command) => element('code', {}, command))]);
      terminal.hidden = commands.length === 0;
      const link = isOfProgram(concern.kind) ? undefined : channel.call;
      showCall([link, channel.attempt], () => link && element('a', { href: `#/calls/${encodeURIComponent(link)}` },
        words.plant.callLink(link), channel.attempt > 1 && ` · ${words.plant.attempt(channel.attempt)}`));
      call.hidden = !link;
    },
  };
}

function whyOf(app, concern, isStranded, last) {
  const advice = words.advice[concern.kind];
  // A reason that repeats the state is left out.
  const isTheState = concern.why === 'unknown_uuid' || (last && concern.why === 'no_instance');
  const reason = isTheState ? '' : concern.reason;
  // A more exact reason replaces the state.
  const isTold = (concern.kind === 'held' && words.reason(reason)) || (concern.kind === 'trouble' && reason);
  const means = concern.gone
    ? words.plant.goneGateway(clock(concern.since - app.clockOffset()), visible(concern.gone.host), concern.gone.pid)
    : last ? words.plant.lastInstance(visible(`${last.host}:${last.pid}`), clock(last.goneAt - app.clockOffset())) : advice?.means;
  return [
    means && !isTold && element('p', { class: 'concern-means' }, means),
    reasonOf(reason),
    isStranded && element('p', { class: 'concern-means' }, words.plant.noInstance),
  ];
}

function adviceOf(concern, last) {
  const advice = words.advice[concern.kind];
  const [channel] = concern.channels;
  const isQueue = concern.kind === 'unserved' && channel?.machine.includes('.');
  const todo = concern.gone ? words.plant.restartGateway(visible(concern.gone.host), concern.gone.journal)
    : last ? words.plant.startAgain(visible(channel.service || channel.uuid)) : isQueue ? advice?.todoOfQueue : advice?.todo;
  const known = words.reason(concern.todo ?? '');
  return advice && [
    element('p', { class: 'who' }, element('span', { class: 'for-readers' }, `${words.plant.who}: `), advice.who, ': '),
    element('p', { class: 'todo' }, element('span', { class: 'for-readers' }, `${words.plant.todo}: `),
      known ? visible(known) : concern.todo ? element('span', { lang: 'en' }, textOf(concern.todo)) : todo),
  ];
}
