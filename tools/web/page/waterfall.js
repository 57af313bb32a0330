// The steps of a call over time. Pure: converts a timeline of `recording calls --json FILE CALL` into lanes with bars; one
// lane for the gateway, one for each attempt.
//
//   const { start, end, lanes } = layOut(timeline);
import { ticks } from './lines.js';
import { milliseconds } from './time.js';

const endsAttempt = new Set(['reply at the gateway', 'late reply dropped', 'reply refused', 'declined by the instance', 'instance lost', 'withdrawn by the program', 'written back']);

/** The steps with `at` in milliseconds by the gateway's clock; steps of a service are converted to it. */
export function placed(steps) {
  return steps.map((step) => {
    const own = milliseconds(step.time);
    if (!step.by_service) {
      return { ...step, at: own };
    }
    let from = -Infinity;
    let to = Infinity;
    for (const other of steps) {
      if (other.by_service || other.attempt !== step.attempt) {
        continue;
      }
      const at = milliseconds(other.time);
      if (other.hop === 'dispatched') {
        from = at;
      } else if (other.hop === 'reply at the gateway' || other.hop === 'late reply dropped') {
        to = Math.min(to, at);
      }
    }
    return { ...step, at: Math.min(Math.max(own, from), Math.max(from, to)) };
  });
}

/** The part of a call that begins with a step of an attempt. */
const partAfter = {
  dispatched: 'toService',
  'received by the instance': 'queue',
  'handler started': 'work',
  'answered by the instance': 'toGateway',
};

function attemptLane(number, steps, end) {
  const own = steps.filter((step) => step.attempt === number);
  const bars = [];
  let open = null;
  const close = (at, ended) => {
    if (open !== null) {
      // An attempt without a reply did not report its begin: all of it is waiting.
      const part = ended && open.part === 'toService' ? 'wait' : open.part;
      bars.push({ part, from: open.at, to: at });
      open = null;
    }
  };
  for (const step of own) {
    if (partAfter[step.hop]) {
      close(step.at, false);
      open = { part: partAfter[step.hop], at: step.at };
    } else if (endsAttempt.has(step.hop)) {
      close(step.at, true);
    }
  }
  close(end, true);
  const marks = own.filter((step) => ['interim state shown', 'reply refused', 'declined by the instance', 'instance lost', 'late reply dropped'].includes(step.hop))
    .map((step) => ({ at: step.at, hop: step.hop }));
  return { number, instance: own.find((step) => step.instance)?.instance ?? '', bars, marks };
}

/** The gateway's own work and waiting between attempts. */
function gatewayLane(steps, end) {
  const bars = [];
  const marks = [];
  let open = null;
  const close = (at) => {
    if (open !== null) {
      bars.push({ part: open.part, from: open.at, to: at });
      open = null;
    }
  };
  const begin = { 'seen by the gateway': 'find', 'no service has this UUID': 'unserved', 'instance lost': 'find', 'held for an operator': 'held', 'reply at the gateway': 'writeBack' };
  for (const step of steps) {
    if (begin[step.hop]) {
      close(step.at);
      open = { part: begin[step.hop], at: step.at };
    } else if (step.hop === 'dispatched' || step.hop === 'written back' || step.hop === 'withdrawn by the program') {
      close(step.at);
    }
    if (['seen by the gateway', 'written back', 'withdrawn by the program'].includes(step.hop)) {
      marks.push({ at: step.at, hop: step.hop });
    }
  }
  close(end);
  return { number: 0, instance: '', bars, marks };
}

/**
 * Times in milliseconds since 1970. A call in progress reaches to `now`, if given. Without steps there are no lanes.
 */
export function layOut(timeline, now = NaN) {
  const steps = placed(timeline.steps ?? []).filter((step) => Number.isFinite(step.at));
  if (steps.length === 0) {
    return { start: NaN, end: NaN, steps, lanes: [], ended: false };
  }
  const ended = steps.some((step) => step.hop === 'written back' || step.hop === 'withdrawn by the program');
  const start = Math.min(...steps.map((step) => step.at));
  const last = Math.max(...steps.map((step) => step.at));
  const end = !ended && now > last ? now : last;
  const numbers = [...new Set(steps.map((step) => step.attempt).filter((attempt) => attempt > 0))].sort((a, b) => a - b);
  const lanes = [gatewayLane(steps, end), ...numbers.map((number) => attemptLane(number, steps, end))];
  return { start, end, steps, lanes, ended };
}

/** A wait for a person or a service that takes more than this share of the call is shortened to that share. */
const longShare = 0.6;
const brokenShare = 0.25;

/**
 * Maps times to 0 … 1: { at(time), broken(bar), pieces } where `pieces` are the parts of the axis between breaks,
 * { from, to }. Without breaks, the other steps of a call that waited for minutes would be invisible.
 */
export function scaleOf({ start, end, lanes }) {
  const total = Math.max(end - start, 1e-3);
  const bar = lanes[0]?.bars.find((each) => (each.part === 'held' || each.part === 'unserved') && each.to - each.from > longShare * total);
  if (!bar) {
    return { at: (time) => (time - start) / total, broken: () => false, pieces: [{ from: start, to: end }] };
  }
  const rest = Math.max(total - (bar.to - bar.from), 1e-3);
  const perMs = (1 - brokenShare) / rest;
  const begin = (bar.from - start) * perMs;
  return {
    at: (time) => (time <= bar.from ? (time - start) * perMs : time >= bar.to ? begin + brokenShare + (time - bar.to) * perMs
      : begin + (brokenShare * (time - bar.from)) / (bar.to - bar.from)),
    broken: (each) => each === bar,
    pieces: [{ from: start, to: bar.from }, { from: bar.to, to: end }],
  };
}

/** The marks of an axis, as { at, after }; `after` counts from the beginning of a piece. */
export function marksOf({ at, pieces }, start, count = 5) {
  const marks = [];
  for (const { from, to } of pieces) {
    for (const tick of ticks(0, to - from, Math.max(1, Math.round(count * (at(to) - at(from)))))) {
      const place = at(from + tick);
      // Marks too close to another one or to the end are unreadable.
      if (marks.length === 0 || (place - marks.at(-1).place > 0.07 && place < 0.93)) {
        marks.push({ place, after: tick === 0 || from === start ? from + tick - start : tick, isMore: tick > 0 && from !== start });
      }
    }
  }
  return marks;
}
