// One call with its waterfall. While the call is in progress, the view follows it.
import { get } from '../api.js';
import { element, replace, slot } from '../dom.js';
import { facts, inReadersLanguage, placeholder, reasonOf, said, stateMark } from '../parts/marks.js';
import { messageOf } from '../texts/sentences.js';
import { waterfallChart } from '../parts/waterfall_chart.js';
import { milliseconds } from '../time.js';
import { words } from '../words.js';

const text = words.call;
const followMs = 1000;

/** `path` is the timeline's path below /api; `back` a link to the previous view. */
export function callView(app, id, path, back) {
  const content = element('div', { class: 'call' }, element('p', {}, words.showing));
  const mark = stateMark('span', 'state');
  const why = element('div');
  const buttons = element('div', { class: 'buttons' });
  const channelPart = element('div', { class: 'call-channel', hidden: true }, mark.node, why, buttons);
  const node = element('div', {},
    element('nav', { class: 'back', 'aria-label': back.text }, element('a', { href: back.href }, `← ${back.text}`)),
    element('h1', { tabindex: '-1' }, text.title(id)), channelPart, content);
  const showWhy = slot(why);
  const showButtons = slot(buttons);
  let timer = 0;
  let shown = null;
  let shownNames = '';
  let recordedIn = [];
  let over = null;

  const nameOf = (instance) => {
    const known = app.model.services.get(instance);
    // The name of an instance that is gone is in the gateway's text about the attempt.
    const recorded = shown?.steps.find((step) => step.hop === 'dispatched' && step.instance === instance)?.detail;
    return known?.name ? `${known.name} @ ${known.host}` : recorded ? inReadersLanguage(recorded) : instance;
  };
  const ended = (timeline) => timeline.steps.some((step) => step.hop === 'written back' || step.hop === 'withdrawn by the program');

  const namesIn = (timeline) => timeline.steps.map((step) => step.instance && nameOf(step.instance)).join('\n');

  function show(timeline) {
    shown = timeline;
    shownNames = namesIn(timeline);
    const first = timeline.steps.find((step) => step.text !== undefined && step.hop === 'seen by the gateway')
      ?? timeline.steps.find((step) => step.text !== undefined);
    const service = app.model.serviceName(timeline.uuid);
    const machine = encodeURIComponent(timeline.machine);
    replace(content,
      facts('call-facts', [
        [words.calls.channel, element('a', { href: `#/calls?machine=${machine}&channel=${timeline.channel}` },
          `${timeline.machine}/${timeline.channel}`)],
        [words.plant.service, element('a', { href: `#/services/${encodeURIComponent(timeline.uuid.toLowerCase())}`, title: timeline.uuid }, service)],
        [words.data.programs, app.model.totals?.program_channels > 0 && element('a', { href: `#/data?machine=${machine}` }, timeline.machine)],
        [words.plant.request, first && said(first.text)],
        [words.recordings.title, recordedIn.length > 0 && recordedIn.map((name, i) => [i > 0 && ', ', element('a', { href: `#/recordings/${encodeURIComponent(name)}/${encodeURIComponent(id)}` }, name)])],
      ]),
      waterfallChart(timeline, nameOf, app.now()));
  }

  /** The channel where this call is pending, with the actions for it. */
  function showChannel() {
    const channel = [...app.model.channels.values()].find((each) => each.call === id && each.view.state !== 'idle');
    channelPart.hidden = !channel || path[0] === 'recordings';
    if (!channel) {
      return;
    }
    const { state, level } = channel.view;
    mark.update(state, level);
    showWhy(channel.reason, () => reasonOf(messageOf(channel, 'reason')));
    showButtons([channel.call, app.session.describe()], () => app.session.buttonsFor(channel));
  }

  /** Shows the recordings that have the call that is over, once it is known whether there are any. */
  async function findRecordings() {
    const timeline = app.model.about?.recordings && over;
    if (!timeline) {
      return;
    }
    over = null;
    const at = milliseconds(timeline.steps.at(-1)?.time);
    const { recordings } = await get(['recordings']).catch(() => ({ recordings: [] }));
    recordedIn = recordings.filter((each) => each.machines?.includes(timeline.machine) && milliseconds(each.start) <= at && (each.writing || at <= milliseconds(each.end))).map(({ name }) => name);
    if (recordedIn.length > 0 && node.isConnected) {
      show(timeline);
    }
  }

  async function ask() {
    try {
      const timeline = await get(path);
      if (!node.isConnected) {
        return;
      }
      show(timeline);
      if (path[0] === 'recordings') {
        return;
      }
      if (!ended(timeline)) {
        timer = setTimeout(ask, followMs);
      } else {
        over = timeline;
        findRecordings();
      }
    } catch (problem) {
      replace(content, problem.status === 404 ? placeholder('missing', text.notKept, path[0] === 'recordings' ? problem.message : text.notKeptWhat)
        : placeholder('failure', words.failure.title, problem.message));
    }
  }

  return {
    node,
    title: () => text.title(id),
    update() {
      showChannel();
      findRecordings();
      // Names of instances may arrive after the timeline.
      if (shown && namesIn(shown) !== shownNames) {
        show(shown);
      }
    },
    enter: ask,
    leave() {
      clearTimeout(timer);
    },
  };
}
