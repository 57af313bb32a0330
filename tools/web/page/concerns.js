// What needs attention, as the server judges it; here is only how it is drawn. Pure.
import { messageOf } from './texts/sentences.js';
import { milliseconds } from './time.js';

/** The shape of each state of a channel and of each kind of concern, in shapes.js. */
export const shapeOf = {
  idle: 'idle', running: 'running', answering: 'answering', waiting: 'waiting', unserved: 'unserved', held: 'held', 'link down': 'down',
  'gateway gone': 'down', 'no gateway': 'down', overdue: 'look', alarm: 'look', 'program aborted': 'down', 'program on hold': 'held',
  journal: 'down', redundancy: 'look', errors: 'look', 'process gone': 'look', unknown: 'unknown',
};

/** The state is of the NC program, not of its call. */
export const isOfProgram = (state) => state === 'program aborted' || state === 'program on hold';

const ofMachines = ['gateway gone', 'link down', 'journal'];

/** The worst level of concerns, and how many of them need a person. */
export function worstOf(concerns) {
  const count = concerns.filter((concern) => concern.level === 'act').length;
  return { level: count > 0 ? 'act' : concerns.length > 0 ? 'look' : 'fine', count };
}

/** The word of words.plant for the number of what needs attention, and the number: { word, count }. */
export function headlineOf(concerns) {
  const { level, count } = worstOf(concerns);
  const urgent = concerns.filter((concern) => concern.level === 'act');
  const all = (holds) => urgent.every(holds);
  const channels = concerns.flatMap((concern) => concern.channels ?? []).length;
  switch (level) {
    case 'fine':
      return { word: 'well', count };
    case 'look':
      return channels > 0 ? { word: 'look', count: channels } : { word: 'warns', count };
    default:
      return { count, word: all(({ kind }) => kind === 'alarm') ? 'needsPrograms'
        : all(({ kind, machines }) => ofMachines.includes(kind) && machines?.length === 1) ? 'needsMachines'
          : all(({ kind, channels: its }) => !ofMachines.includes(kind) && its?.length === 1) ? 'needs' : 'needsMixed' };
  }
}

const nameOf = ({ machine, channel }) => `${machine}/${channel}`;
const isOfMachines = ({ kind }) => ofMachines.includes(kind);

/** What a card is about: its first channel, or all machines, the process, or the service; a text or a sentence. */
export const concernName = (concern) => (concern.channels && !isOfMachines(concern) ? nameOf(concern.channels[0]) : messageOf(concern, 'subject'));

/** The other channels with the same cause. */
export const otherChannels = (concern) => (isOfMachines(concern) ? [] : (concern.channels ?? []).slice(1).map(nameOf));

/**
 * The acknowledgement of a concern among those that the server keeps; null if there is none. A concern that began after the
 * acknowledgement is a new one, by the clock of the gateway that reports the begin, or by that of the server.
 */
export function acknowledgementOf(concern, acknowledged) {
  const found = acknowledged.find((each) => each.cause === concern.cause);
  return found && !(milliseconds(concern.since) > Math.max(milliseconds(found.since) || 0, milliseconds(found.time))) ? found : null;
}
