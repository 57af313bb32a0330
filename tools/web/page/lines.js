// Lines over time: their shape and their axes; and machine data as lines, assembled from the responses of the server. Pure.
//
//   const line = new Line('1/axes/V.A.ACT_POS.X');
//   line.take(series);                        // of /api/data/history
//   line.since                                // for the next request
//   line.points(from, to)                     // [[time, value or null] …], as a plot draws steps
/** The server may still change points that are younger than this. */
const grainMs = 500;

export class Line {
  /** The present value: quality, text, type, reason … */
  now = null;
  #times = [];
  #values = [];
  #asked = 0;

  constructor(id) {
    this.id = id;
  }

  /** Time of the last final point, in milliseconds; 0 if there is none. */
  get since() {
    return this.#times.length > 0 ? Math.max(0, this.#times.at(-1) - grainMs) : 0;
  }

  take(series) {
    this.now = series;
    if (series.whole) {
      this.#times = [];
      this.#values = [];
    } else {
      // The response repeats points that may have changed.
      const keep = this.#times.findLastIndex((time) => time < this.#asked) + 1;
      this.#times.length = keep;
      this.#values.length = keep;
    }
    this.#times.push(...series.times);
    this.#values.push(...series.values);
  }

  /** Marks the begin of a request; its response has all points since then. */
  ask() {
    this.#asked = this.since;
    return this.#asked;
  }

  /** Drops what ends before `from`. */
  forget(from) {
    const first = this.#times.findLastIndex((time) => time <= from);
    if (first > 0) {
      this.#times.splice(0, first);
      this.#values.splice(0, first);
    }
  }

  /**
   * Points between `from` and `to`: a value holds until the next one, the last one until `to`; unknown values are null.
   */
  points(from, to) {
    const points = [];
    let before = null;
    this.#times.forEach((time, i) => {
      const value = this.#values[i];
      if (time > to) {
        return;
      }
      if (time <= from) {
        before = value;
        return;
      }
      if (points.length === 0 && before !== null) {
        points.push([from, before]);
      }
      if (value === null && before !== null) {
        // The value held until then.
        points.push([time - 1, before]);
      }
      points.push([time, value]);
      before = value;
    });
    if (before !== null) {
      if (points.length === 0) {
        points.push([from, before]);
      }
      points.push([to, before]);
    }
    return points;
  }
}

/** Whether a value can be drawn as a line. */
export const isNumber = (value) => !value.array && !Array.isArray(value.value) && value.type !== 'STRING' && value.type !== 'UNKNOWN';

/** The variables of a machine with their values: [{ id, channel, group, value … }]; `id` is the name for requests. */
export function variablesOf(samples) {
  return samples.flatMap((sample) => sample.values.map((value) => ({
    id: `${sample.channel}/${sample.group}/${value.name}`, sample, value,
  })));
}

/** Good, stale or refused, unknown for that of a later version; a value of a removed group is stale. */
export const qualityOf = (gone, quality) => (!['good', 'stale', 'refused'].includes(quality) ? 'unknown' : gone && quality === 'good' ? 'stale' : quality);

/** The part of a time span that a run covers: { left, width }; null if none. */
export function placeOf(started, ended, from, to) {
  const left = Math.max(started, from);
  const right = Math.min(ended, to);
  return right < from || left > to || !(right >= left) ? null
    : { left: (left - from) / (to - from), width: (right - left) / (to - from) };
}

export const isKnown = (value) => value !== null && value !== undefined;

/** The path of a line; unknown values interrupt it. `x(i)` and `y(value)` are the places; with `step` a value holds until the next. */
export function pathOf(values, x, y, step = false) {
  let path = '';
  let isOpen = false;
  values.forEach((value, i) => {
    if (isKnown(value)) {
      const [left, top] = [x(i).toFixed(2), y(value).toFixed(2)];
      // A single value between two unknown ones is a dot.
      path += !isOpen ? `M${left} ${top}h0` : step ? `H${left}V${top}` : `L${left} ${top}`;
    }
    isOpen = isKnown(value);
  });
  return path;
}

/** The shown range of values, with some room above and below; `withZero`: from 0 on. */
export function rangeOf(values, withZero) {
  const known = withZero ? [0, ...values.filter(isKnown)] : values.filter(isKnown);
  const [low, high] = known.length === 0 ? [0, 1] : [Math.min(...known), Math.max(...known)];
  const room = (high - low || Math.abs(high) || 1) / 10;
  return [withZero && low === 0 ? 0 : low - room, high + room];
}

function multiples(step, from, to) {
  const first = Math.ceil(from / step - 1e-9);
  return Array.from({ length: Math.max(0, Math.floor(to / step + 1e-9) - first + 1) }, (_, i) => (first + i) * step);
}

/** Round marks of an axis, at most `count` and one. */
export function ticks(from, to, count = 5) {
  if (!(to > from)) {
    return [from];
  }
  const rough = (to - from) / count;
  const power = 10 ** Math.floor(Math.log10(rough));
  return multiples([1, 2, 5, 10].map((factor) => factor * power).find((each) => each >= rough), from, to);
}

/** Round times between `from` and `to`, at most `count` and one. */
export function timeTicks(from, to, count) {
  const seconds = [1, 2, 5, 10, 15, 30, 60, 120, 300, 600, 1800, 3600];
  return multiples(1000 * (seconds.find((each) => 1000 * each * count >= to - from) ?? seconds.at(-1)), from, to);
}
