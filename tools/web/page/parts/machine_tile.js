// A machine: its link, and a row for each of its channels.
import { isOfProgram } from '../concerns.js';
import { element, Keyed, replace, setAttribute, setText, visible } from '../dom.js';
import { keyOf, queueOf } from '../model.js';
import { shape } from '../shapes.js';
import { messageOf } from '../texts/sentences.js';
import { age, duration, milliseconds, period } from '../time.js';
import { perSecond, words } from '../words.js';
import { inReadersLanguage, stateMark } from './marks.js';

/** A shorter call is shown without its text: at ten calls a second it is unreadable. */
const readableMs = 700;

function linkText(link, isServed) {
  return link.connected ? words.plant.linkUp : isServed ? words.plant.linkStandby : link.gone ? words.plant.linkGone : words.plant.linkDown;
}

/** The response time of a controller, and how the gateway notices requests. */
function linkDetail(link) {
  return link.connected && !link.gone
    ? words.plant.linkDetail(duration(link.round_trip_ms), link.watch === 'pushed' ? words.plant.pushed : words.plant.polled(period(link.poll_ms))) : '';
}

/** The service of the call, and its request if it lasts long enough to be read. */
function detailOf(channel, state, level, lasting, isBusy) {
  const service = visible(channel.service || channel.uuid || '');
  const isUnderWay = (Boolean(channel.call) || state === 'unserved') && state !== 'idle';
  if (isUnderWay && (lasting > readableMs || level !== 'fine')) {
    const by = [channel.name !== channel.service && channel.name, channel.host && `@ ${channel.host}`].filter(Boolean).map(visible).join(' ');
    const request = channel.request === undefined ? '' : ` ${words.quoted(visible(channel.request))}`;
    return `${service}${request}${by && ` ${by}`}`;
  }
  return isBusy || state !== 'idle' ? service : channel.calls > 0 ? '' : words.plant.quiet;
}

/** The NC program of a channel: a shape, its name, and its error. */
function programCell() {
  const icon = element('span', { class: 'program-shape' });
  const text = element('span', { class: 'program-name' });
  const node = element('span', { class: 'channel-program' }, icon, text);
  let shown = '';
  return {
    node,
    update(program) {
      const state = program?.state ?? 'none';
      if (state !== shown) {
        shown = state;
        replace(icon, program && shape({ aborted: 'down', 'on hold': 'paused' }[state] ?? 'play'));
        setAttribute(node, 'data-program', state);
      }
      const more = state === 'aborted' ? [words.plant.aborted, program.error && words.plant.errorOf(program.error)].filter(Boolean).join(', ')
        : state === 'on hold' ? words.plant.onHold : '';
      setText(text, [visible(program?.name ?? '').replace(/\.nc$/i, ''), more].filter(Boolean).join(' · '));
      setAttribute(node, 'title', program ? `${words.plant.program}: ${visible(program.name)}${more && `, ${more}`}` : null);
    },
  };
}

function channelRow() {
  const mark = stateMark('span', 'state');
  const program = programCell();
  const number = element('span', { class: 'channel-number' });
  const detail = element('span', { class: 'channel-detail' });
  const since = element('span', { class: 'channel-since' });
  const link = element('a', { class: 'channel' }, number, program.node, element('span', { class: 'channel-call' }, mark.node, detail), since);
  const node = element('li', {}, link);
  return {
    node,
    update({ channel, queue, now }) {
      const { state, level, call, call_level: callLevel } = channel.view;
      const lasting = now - milliseconds(channel.view.since);
      // A busy channel alternates between idle and running; the duration of one call means nothing.
      const isBusy = level === 'fine' && channel.calls_per_second > 0 && lasting < 10_000;
      mark.update(isBusy ? 'running' : call, callLevel);
      program.update(queue ? null : channel.program);
      setAttribute(link, 'data-level', level);
      setAttribute(link, 'data-state', state);
      setAttribute(link, 'data-channel', `${channel.machine}/${channel.channel}`);
      setAttribute(link, 'href', channel.call && state !== 'idle' && !isOfProgram(state) ? `#/calls/${encodeURIComponent(channel.call)}`
        : `#/calls?machine=${encodeURIComponent(channel.machine)}&channel=${channel.channel}`);
      setText(number, queue ? visible(queue) : String(channel.channel));
      setAttribute(link, 'data-queue', queue || null);
      setAttribute(link, 'data-alone', isOfProgram(state));
      setAttribute(number, 'title', queue ? words.plant.queue(visible(queue), channel.channel) : words.plant.channel(channel.channel));
      setText(detail, detailOf(channel, call, callLevel, lasting, isBusy));
      setText(since, isBusy ? `${perSecond(channel.calls_per_second)}/s` : age(lasting));
      setAttribute(since, 'title', isBusy ? `${words.plant.rate(perSecond(channel.calls_per_second))} · ${duration(channel.recent_mean_ms)}` : null);
    },
  };
}

function levelOfMachine(machine) {
  const levels = machine.channels.map((channel) => channel.view.level);
  if (machine.links.length > 0 && !machine.links.some((link) => link.connected)) {
    return 'act';
  }
  return levels.includes('act') ? 'act' : levels.includes('look') ? 'look' : 'fine';
}

export function machineTile() {
  const name = element('h3', { class: 'machine-name' });
  const mark = element('span', { class: 'machine-shape' });
  const links = element('ul', { class: 'links' });
  const channels = element('ul', { class: 'channels' });
  const node = element('article', { class: 'machine' }, element('header', {}, mark, name, links), channels);
  const rows = new Keyed(channels, () => channelRow());
  const linkRows = new Keyed(links, () => {
    const text = element('span', { class: 'link-text' });
    const detail = element('span', { class: 'link-detail' });
    const gateway = element('span', { class: 'link-gateway' });
    const item = element('li', {}, text, detail, gateway);
    return {
      node: item,
      update({ link, several, isServed }) {
        setText(text, linkText(link, isServed));
        setText(detail, linkDetail(link));
        setAttribute(item, 'data-level', link.connected || isServed ? 'fine' : 'act');
        const host = visible(link.gateway_host ?? '');
        setText(gateway, host && several ? words.plant.gateway(host, link.gateway_version) : '');
        setAttribute(item, 'title', [linkDetail(link), visible(link.address), host && words.plant.gateway(host, link.gateway_version),
          visible(inReadersLanguage(messageOf(link, 'reason')))].filter(Boolean).join(' · '));
      },
    };
  });
  return {
    node,
    update({ machine, now, density }) {
      setText(name, machine.name);
      setAttribute(node, 'data-machine', machine.name);
      const level = levelOfMachine(machine);
      if (node.dataset.level !== level) {
        setAttribute(node, 'data-level', level);
        replace(mark, level !== 'fine' && shape('look'));
      }
      setAttribute(node, 'data-density', density);
      setAttribute(node, 'data-unreachable', density !== 'strip' && machine.links.length > 0 && !machine.links.some((link) => link.connected));
      // Room for the longest number of a channel.
      node.style.setProperty('--digits', Math.max(1, ...machine.channels.map((channel) => String(channel.channel).length)));
      linkRows.show(machine.links.map((link) => ({ link, several: machine.links.length > 1, isServed: machine.links.some((each) => each.connected) })), ({ link }) => link.gateway);
      rows.show(machine.channels.map((channel) => ({ channel, queue: queueOf(channel, machine.name), now })),
        ({ channel }) => keyOf(channel.machine, channel.channel));
    },
  };
}
