// Times for people. Times of the fabric are ISO 8601 in UTC with microseconds, which Date would cut. Durations are numbers of
// milliseconds with a fraction.

let decimalPoint = '.';

/** Sets the decimal sign of durations; the default is ".". */
export function setDecimalPoint(text) {
  decimalPoint = text;
}

/** Milliseconds since 1970, with microseconds as a fraction; NaN if there is no time. */
export function milliseconds(iso) {
  const match = /^(\d{4}-\d\d-\d\dT\d\d:\d\d:\d\d)(\.\d+)?Z$/.exec(iso ?? '');
  return match ? Date.parse(`${match[1]}Z`) + Number(match[2] ?? 0) * 1000 : NaN;
}

/** Three digits and a unit, as the commands print it: "395 us", "1.23 ms", "45.6 s"; from a minute on "2 min 05 s". */
export function duration(ms) {
  if (!Number.isFinite(ms)) {
    return '–';
  }
  const size = Math.abs(ms);
  if (size === 0) {
    return '0 µs';
  }
  if (size < 1) {
    return `${digits(ms * 1000)} µs`;
  }
  if (size < 1000) {
    return `${digits(ms)} ms`;
  }
  if (size < 60_000) {
    return `${digits(ms / 1000)} s`;
  }
  return age(ms);
}

/** A configured period, without digits that say nothing: "10 ms". */
export function period(ms) {
  return duration(ms).replace(/[.,]0+ /, ' ');
}

function digits(value) {
  const size = Math.abs(value);
  return value.toFixed(size < 9.995 ? 2 : size < 99.95 ? 1 : 0).replace('.', decimalPoint);
}

/** An elapsed time in whole seconds, two units: "12 s", "3 min 05 s", "2 h 10 min", "4 d 3 h". */
export function age(ms) {
  if (!Number.isFinite(ms)) {
    return '–';
  }
  // Another host's clock may be ahead.
  const seconds = Math.max(0, Math.floor(ms / 1000));
  const two = (value) => String(value).padStart(2, '0');
  if (seconds < 60) {
    return `${seconds} s`;
  }
  if (seconds < 3600) {
    return `${Math.floor(seconds / 60)} min ${two(seconds % 60)} s`;
  }
  if (seconds < 86_400) {
    return `${Math.floor(seconds / 3600)} h ${two(Math.floor(seconds / 60) % 60)} min`;
  }
  return `${Math.floor(seconds / 86_400)} d ${Math.floor(seconds / 3600) % 24} h`;
}

/** The local time of day, "14:03:22". */
export function clock(ms) {
  return Number.isFinite(ms) ? new Date(ms).toTimeString().slice(0, 8) : '–';
}

/** The local time of day to the microsecond, "14:03:22.123456". */
export function fineClock(ms) {
  if (!Number.isFinite(ms)) {
    return '–';
  }
  const whole = Math.floor(ms / 1000) * 1000;
  const micros = Math.min(999_999, Math.round((ms - whole) * 1000));
  return `${clock(whole)}.${String(micros).padStart(6, '0')}`;
}

/** Date and time of day, "2026-03-01 14:03:22"; without the date if it is that of `today`. */
export function moment(ms, today = NaN) {
  if (!Number.isFinite(ms)) {
    return '–';
  }
  const day = (time) => {
    const date = new Date(time);
    return [date.getFullYear(), date.getMonth() + 1, date.getDate()].map((part) => String(part).padStart(2, '0')).join('-');
  };
  return Number.isFinite(today) && day(ms) === day(today) ? clock(ms) : `${day(ms)} ${clock(ms)}`;
}
