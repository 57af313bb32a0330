// A cause that needs attention, in two or three lines: state, place, time, reason, person in charge, action.
import { acknowledgementOf, concernName, isOfProgram, otherChannels } from '../concerns.js';
import { element, setAttribute, setText, slot, visible } from '../dom.js';
import { keyOf } from '../model.js';
import { age, milliseconds, moment } from '../time.js';
import { messageOf, textOf } from '../texts/sentences.js';
import { words } from '../words.js';
import { asSentence, explained, inReadersLanguage, reasonOf, said, stateMark } from './marks.js';

/** The service and the request of the call. */
function subjectOf(concern, channel) {
  if (!channel || concern.kind === 'gateway gone' || concern.kind === 'link down' || concern.kind === 'journal' || isOfProgram(concern.kind)) {
    return [];
  }
  return [visible(channel.service || channel.uuid), channel.request !== undefined && [' ', said(channel.request)]];
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
  let current = null;
  const showSince = slot(since);
  const showSubject = slot(subject);
  const showWhy = slot(why);
  const showAdvice = slot(advice);
  const showButtons = slot(buttons);
  const showTerminal = slot(terminal);
  const showCall = slot(call);
  return {
    node,
    update({ concern, now }) {
      const known = milliseconds(concern.since);
      const channel = concern.channels && app.model.channels.get(keyOf(concern.channels[0].machine, concern.channels[0].channel));
      const what = messageOf(concern, 'what');
      const reason = messageOf(concern, 'why');
      mark.update(concern.kind, concern.level, words.states[concern.kind] ?? visible(inReadersLanguage(what)));
      setAttribute(node, 'data-level', concern.level);
      setAttribute(node, 'data-kind', concern.kind);
      setText(name, visible(inReadersLanguage(concernName(concern))));
      setText(lasting, Number.isFinite(known) ? age(now - known) : '');
      const began = Number.isFinite(known) ? words.plant.since(moment(known - app.clockOffset(), Date.now())) : '';
      // A phone has no room for the seconds.
      showSince([began], () => [began.slice(0, -3), element('span', { class: 'seconds' }, began.slice(-3))]);
      const isAlone = concern.channels?.length === 1 && channel;
      const mayAct = (concern.kind === 'held' || concern.kind === 'overdue') && isAlone && channel.call;
      showSubject([concern.kind, channel?.service, channel?.uuid, channel?.request], () => subjectOf(concern, channel));
      showWhy([textOf(reason)], () => reasonOf(reason));
      const steps = concern.todo.map((step) => messageOf(step, 'text'));
      const sentences = steps.filter(({ code }) => code !== 'run_command');
      showAdvice([concern.who, ...sentences.map(textOf)], () => adviceOf(concern.who, sentences));
      const also = otherChannels(concern);
      others.hidden = also.length === 0;
      setText(others, words.plant.alsoWaiting(visible(also.join(', '))));
      const by = acknowledgementOf(concern, app.model.acknowledged);
      taken.hidden = !by;
      setText(taken, by ? words.plant.taken(visible(by.by), moment(milliseconds(by.time) - app.clockOffset(), Date.now()), visible(by.note)) : '');
      current = concern;
      showButtons([mayAct, concern.machines?.length, by?.by, app.session.describe()], () => [mayAct ? app.session.buttonsFor(channel) : [],
        concern.kind === 'gateway gone' && app.session.forgetButton(() => current),
        by?.by === app.session.user && by ? null : app.session.acknowledgeButton(() => current)]);
      buttons.hidden = !buttons.firstChild;
      const acts = buttons.querySelector('[data-action="retry"], [data-action="answer"]') !== null;
      setAttribute(node, 'data-acts', acts);
      const commands = acts ? [] : steps.filter(({ code }) => code === 'run_command').map((step) => visible(step.arguments[0]));
      showTerminal(commands, () => commands.length > 0 && [element('span', { class: 'label' }, `${words.command}: `),
        commands.map((command) => element('code', {}, command))]);
      terminal.hidden = commands.length === 0;
      const link = isAlone && !isOfProgram(concern.kind) ? channel.call : undefined;
      showCall([link, channel?.attempt], () => link && element('a', { href: `#/calls/${encodeURIComponent(link)}` },
        words.plant.callLink(link), channel.attempt > 1 && ` · ${words.plant.attempt(channel.attempt)}`));
      call.hidden = !link;
    },
  };
}

/** The steps as sentences, in the reader's language; one without a translation is marked as English. */
function adviceOf(who, steps) {
  return [
    element('p', { class: 'who' }, element('span', { class: 'for-readers' }, `${words.plant.who}: `), words.roles[who] ?? who, ': '),
    element('p', { class: 'todo' }, element('span', { class: 'for-readers' }, `${words.plant.todo}: `),
      steps.map((step, i) => [i > 0 && ' ', explained(step, null, 'span', asSentence)])),
  ];
}
