// Machine data as lines over time, put together from what the server tells piece by piece. Pure.
//
//   const line = new Line('1/axes/V.A.ACT_POS.X');
//   line.take(series);                        // of /api/data/history
//   line.since                                // what to ask for next
//   line.points(from, to)                     // [[time, value or null] …], as a plot draws steps
/** What the server may still change of the points that it has told, and more. */
const grainMs = 500;

export class Line {
  /** What it is now: quality, text, type, reason … */
  now = null;
  #times = [];
  #values = [];
  #asked = 0;

  constructor(id) {
    this.id = id;
  }

  /** The last point that will not change any more, in milliseconds; 0 if there is none. */
  get since() {
    return this.#times.length > 0 ? Math.max(0, this.#times.at(-1) - grainMs) : 0;
  }

  take(series) {
    this.now = series;
    if (series.whole) {
      this.#times = [];
      this.#values = [];
    } else {
      // The same time was told again, with what became of it.
      const keep = this.#times.findLastIndex((time) => time < this.#asked) + 1;
      this.#times.length = keep;
      this.#values.length = keep;
    }
    this.#times.push(...series.times);
    this.#values.push(...series.values);
  }

  /** What is asked for now: the next answer has all from then on. */
  ask() {
    this.#asked = this.since;
    return this.#asked;
  }

  /** Forgets what ends before `from`. */
  forget(from) {
    const first = this.#times.findLastIndex((time) => time <= from);
    if (first > 0) {
      this.#times.splice(0, first);
      this.#values.splice(0, first);
    }
  }

  /**
   * From `from` to `to`: a value holds until the next one, the last one until `to`, and where nothing is known there is
   * null.
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
        // It held until then.
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

/** The names of a machine's variables as they are asked for, with their values: [{ id, channel, group, value … }]. */
export function variablesOf(samples) {
  return samples.flatMap((sample) => sample.values.map((value) => ({
    id: `${sample.channel}/${sample.group}/${value.name}`, sample, value,
  })));
}

/** Good, stale or refused; what nobody tells of any more is stale. */
export const qualityOf = (gone, quality) => (gone && quality === 'good' ? 'stale' : quality);

/** Where a run lies between two times, as parts of that time: { left, width }; null if it does not. */
export function placeOf(started, ended, from, to) {
  const left = Math.max(started, from);
  const right = Math.min(ended, to);
  return right < from || left > to || !(right >= left) ? null
    : { left: (left - from) / (to - from), width: (right - left) / (to - from) };
}
