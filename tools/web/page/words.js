// The page's language: that of the browser, or of `?lang=`; English if there are no texts for it.
import { setDecimalPoint } from './time.js';

const known = ['en', 'de'];

function choose() {
  const asked = new URLSearchParams(location.search).get('lang');
  const wanted = [asked, ...navigator.languages].filter(Boolean).map((tag) => tag.slice(0, 2).toLowerCase());
  return wanted.find((language) => known.includes(language)) ?? 'en';
}

export const language = choose();
export const words = (await import(`./texts/${language}.js`)).default;
setDecimalPoint((1.5).toLocaleString(language).at(1));

/** A number in this language, with at most `digits` decimals. */
export function number(value, digits = 0) {
  return Number.isFinite(value) ? value.toLocaleString(language, { maximumFractionDigits: digits }) : words.services.noValue;
}

/** Calls per second: one digit below ten. */
export function perSecond(value) {
  return number(value, value < 9.95 ? 1 : 0);
}

/** A size in bytes: "1.2 MiB". */
export function size(bytes) {
  const units = ['B', 'KiB', 'MiB', 'GiB', 'TiB'];
  const power = bytes < 1 ? 0 : Math.min(units.length - 1, Math.floor(Math.log2(bytes) / 10));
  return `${number(bytes / 1024 ** power, power === 0 ? 0 : 1)} ${units[power]}`;
}
