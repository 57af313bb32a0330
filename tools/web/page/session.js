// The logged-in user and that user's permissions; the buttons for actions, and their dialogs.
import { get, post } from './api.js';
import { concernName } from './concerns.js';
import { channelName, keyOf } from './model.js';
import { element, replace, visible } from './dom.js';
import { ask, tell } from './parts/dialog.js';
import { inReadersLanguage, said } from './parts/marks.js';
import { messageOf } from './texts/sentences.js';
import { milliseconds, moment } from './time.js';
import { words } from './words.js';

const text = words.actions;

/** `app` has the model; `app.changed()` is called after login and logout. */
export function makeSession(app) {
  let state = { actions: false };

  const keep = (fresh) => {
    state = fresh;
    app.changed();
  };
  const may = (action) => state.actions && (!state.user || (state.may ?? []).includes(action));

/** Asks for name and password; true if a user is logged in afterwards. */
  async function login() {
    const user = element('input', { name: 'user', autocomplete: 'username', required: true, autocapitalize: 'none' });
    const password = element('input', { name: 'password', type: 'password', autocomplete: 'current-password', required: true });
    const done = await ask({
      title: text.loginTitle,
      body: [element('p', {}, text.loginWhat),
        element('label', {}, element('span', {}, text.user), user),
        element('label', {}, element('span', {}, text.password), password)],
      act: text.login,
      perform: async () => keep(await post(['login'], { user: user.value, password: password.value })),
    });
    return done && Boolean(state.user);
  }

  async function logout() {
    try {
      await post(['logout'], {}, state.token);
    } finally {
      keep({ actions: state.actions });
    }
  }

  /** Performs a confirmed action; the dialog ends with the outcome, done or refused. */
  async function perform(action, body) {
    try {
      const outcome = await post(['actions', action], body, state.token);
      // What the card shows needs no message.
      return outcome.done && ['acknowledge', 'forget'].includes(action) ? undefined : outcome.done ? text.done(outcome.detail) : { refused: text.refused(outcome.detail) };
    } catch (problem) {
      if (problem.status === 401) {
        keep({ actions: state.actions });
        throw new Error(text.sessionOver, { cause: problem });
      }
      throw problem;
    }
  }

  async function confirmed(dialog, action, body) {
    if (!state.user && !(await login())) {
      return;
    }
    if (!may(action)) {
      await tell(words.failure.title, text.refused(action));
      return;
    }
    await ask({ ...dialog, act: dialog.act, consequence: dialog.consequence, perform: () => perform(action, body()) });
  }

  /** Throws if the call of the dialog is not pending any more. */
  function mustBePending(channel) {
    const current = app.model.channels.get(keyOf(channel.machine, channel.channel));
    if (current?.call !== channel.call) {
      throw new Error(text.over);
    }
  }

  /** The present data of the call. */
  function asItIs(channel) {
    const current = app.model.channels.get(keyOf(channel.machine, channel.channel));
    return current?.call === channel.call ? current : channel;
  }

  const pairsOf = (channel) => [
    [text.channel, visible(channelName(channel))],
    [text.call, channel.call],
    [text.service, visible(channel.service || channel.uuid)],
    [text.request, channel.request === undefined ? null : said(channel.request)],
  ];

  /** The last response of the service of this channel, which appears when the server has sent it. */
  function lastResponse(channel) {
    const node = element('span', { class: 'last-response' }, words.services.noValue);
    get(['calls'], { uuid: channel.uuid, limit: 20 }).then(({ calls }) => {
      const last = calls.find((call) => call.response !== undefined && !call.failed);
      if (last) {
        replace(node, said(last.response), ` ${words.call.stateOf(last.response_state)}, ${moment(milliseconds(last.ended) - app.clockOffset(), Date.now())}`);
      }
      // Without it an operator can answer all the same.
    }).catch(() => {});
    return node;
  }

  function answer(channel) {
    const response = element('input', { name: 'response', maxlength: 127, autocomplete: 'off', 'aria-describedby': 'response-hint' });
    const number = element('input', {
      name: 'state', type: 'number', min: 1, max: 4294967295, step: 1, required: true, autocomplete: 'off', 'aria-describedby': 'state-hint',
    });
    return confirmed({
      title: text.answerTitle(visible(channelName(channel))),
      pairs: [...pairsOf(channel), [text.last, lastResponse(channel)]],
      body: [
        element('label', {}, element('span', {}, text.response), response, element('small', { id: 'response-hint' }, text.responseHint)),
        element('label', {}, element('span', {}, text.state), number, element('small', { id: 'state-hint' }, text.stateHint)),
      ],
      consequence: text.answerDoes,
      act: text.doAnswer(visible(channelName(channel))),
    }, 'answer', () => {
      mustBePending(channel);
      return {
        machine: channel.machine, channel: channel.channel, call: channel.call, response: response.value, state: Number(number.value),
      };
    });
  }

  function retry(channel) {
    return confirmed({
      title: text.retryTitle(visible(channelName(channel))),
      pairs: pairsOf(channel),
      consequence: channel.instances === 0 ? `${text.retryDoes} ${words.plant.noInstance}` : text.retryDoes,
      act: text.doRetry(visible(channelName(channel))),
    }, 'retry', () => {
      mustBePending(channel);
      return { machine: channel.machine, channel: channel.channel, call: channel.call };
    });
  }

  /** No other instance of its service accepts calls. */
  const isLast = (service) => ![...app.model.services.values()].some((other) => other.uuid === service.uuid
    && other.instance !== service.instance && other.goneAt === undefined && !other.draining);

  function drain(service) {
    const name = visible(service.name || service.instance);
    return confirmed({
      title: text.drainTitle(name),
      pairs: [[text.instance, service.instance], [text.service, service.uuid],
        [words.services.columns.host, `${visible(service.host)}, ${words.services.pid(service.pid)}`]],
      consequence: isLast(service) ? `${text.drainDoes} ${text.drainLast}` : text.drainDoes,
      act: text.doDrain(name),
    }, 'drain', () => ({ instance: service.instance }));
  }

  function acknowledge(concern) {
    const note = element('input', { name: 'note', maxlength: 120, autocomplete: 'off' });
    const name = inReadersLanguage(concernName(concern));
    return confirmed({
      title: text.acknowledgeTitle(visible(name)),
      pairs: [[text.state, inReadersLanguage(messageOf(concern, 'what'))]],
      body: [element('label', {}, element('span', {}, text.note), note)],
      consequence: text.acknowledgeDoes,
      act: text.doAcknowledge,
    }, 'acknowledge', () => ({ cause: concern.cause, name, since: concern.since ?? '', note: note.value.trim() }));
  }

  function forget(concern) {
    const names = visible(concern.machines.join(', '));
    return confirmed({
      title: text.forgetTitle(names), consequence: text.forgetDoes, act: text.doForget,
    }, 'forget', () => ({ machines: concern.machines }));
  }

  const button = (action, label, act, hint = null) => may(action) && !app.isWall
    && element('button', { type: 'button', class: 'act', 'data-action': action, title: hint, onclick: act }, label);

  return {
    /** Asks the server for the logged-in user; without actions there is none. */
    async refresh() {
      keep(app.model.about?.actions ? await get(['session']).catch(() => ({ actions: false })) : { actions: false });
    },
    get user() {
      return state.user ?? '';
    },
    get actions() {
      return Boolean(state.actions);
    },
    /** Changes when other buttons must be shown. */
    describe: () => [state.actions, state.user, state.may],
    /** Buttons for the call that waits in the channel; they ask with its data at the time of the click. */
    buttonsFor: (channel) => [
      button('answer', text.answer, () => answer(asItIs(channel))),
      button('retry', text.retry, () => retry(asItIs(channel))),
    ].filter(Boolean),
    /** `concernNow` returns the concern at the time of the click. */
    acknowledgeButton: (concernNow) => button('acknowledge', text.acknowledge, () => acknowledge(concernNow()), text.acknowledgeHint),
    /** For machines whose gateway is gone. */
    forgetButton: (concernNow) => button('forget', text.forget(concernNow().machines.length), () => forget(concernNow())),
    drainButton: (service) => button('drain', text.drain, () => drain(service), text.drainHint) || null,
    login,
    logout,
  };
}
