// Small elements of several views: a state with shape and word, a text of the fabric, a line of facts.
import { shapeOf } from '../concerns.js';
import { element, replace, setAttribute, setText, visible } from '../dom.js';
import { shape } from '../shapes.js';
import { textOf } from '../texts/sentences.js';
import { words } from '../words.js';

/** A state by shape, colour and word; { node, update(state, level, text) }. */
export function stateMark(tag = 'span', className = 'state') {
  const icon = element('span', { class: 'state-shape' });
  const word = element('span', { class: 'state-word' });
  const node = element(tag, { class: className }, icon, word);
  let shown = '';
  return {
    node,
    update(state, level, text = words.states[state] ?? state) {
      if (state !== shown) {
        shown = state;
        icon.replaceChildren(shape(shapeOf[state] ?? 'unknown'));
        setAttribute(node, 'data-state', state);
      }
      setText(word, text);
      setAttribute(node, 'data-level', level);
    },
  };
}

/** A text of a program, a service or a gateway; those of gateways are English. */
export function said(text, properties = {}) {
  return element('q', { class: 'said', ...properties }, text);
}

/** A gateway's reason, in the reader's language if there is a translation; a text of others is quoted. */
export function reasonOf(reason) {
  const known = words.reason(reason ?? '') || (reason?.code && asSentence(reason.text));
  return reason && (known ? element('p', { class: 'reason' }, withCode(known)) : said(textOf(reason), { lang: 'en', class: 'said reason' }));
}

/** A sentence of a program, in the reader's language if there is a translation. */
export const inReadersLanguage = (sentence) => words.reason(sentence) || textOf(sentence);

/** Sentences of the fabric begin with a small letter and have no full stop. */
export const asSentence = (text) => (/^[a-z]/.test(text) ? text[0].toUpperCase() + text.slice(1) + (/[.?!]$/.test(text) ? '' : '.') : text);

/** The same as an element; `dressed` changes its text. */
export function explained(sentence, className = null, tag = 'span', dressed = (text) => text) {
  return element(tag, { class: className, lang: words.reason(sentence) ? null : 'en' }, withCode(dressed(inReadersLanguage(sentence))));
}

/** What sentences have in backticks, such as commands, is code. */
const withCode = (text) => text.split(/`([^`]+)`/).map((part, i) => (i % 2 === 1 ? element('code', {}, part) : part));

/** A description list: pairs of term and value; pairs without a value are left out. */
export function facts(className, pairs) {
  return element('dl', { class: `facts ${className}` }, pairs.filter(([, value]) => value !== false && value !== null && value !== undefined && value !== '')
    .map(([term, value]) => element('div', {}, element('dt', {}, term), element('dd', {}, value))));
}

/** The head of a table: a cell for each column, with its text of `texts` and the class cell-COLUMN. */
export function tableHead(columns, texts) {
  return element('thead', {}, element('tr', {}, columns.map((column) => element('th', { scope: 'col', class: `cell-${column}` }, texts[column]))));
}

/** A part of the page with its own scroll bar, also usable by keyboard. */
export function scrolling(label, ...content) {
  return element('div', { class: 'scroll', tabindex: '0', role: 'region', 'aria-label': label }, content);
}

/** Copies a text to the clipboard; without TLS, browsers allow this only through a selection. */
export function copyButton(textNow) {
  const button = element('button', { type: 'button', class: 'copy', onclick: async () => {
    try {
      await navigator.clipboard.writeText(textNow());
    } catch {
      const area = element('textarea', {}, textNow());
      button.after(area);
      area.select();
      document.execCommand('copy');
      area.remove();
    }
    setText(button, words.copied);
  } }, words.copy);
  return button;
}

/** Replaces missing content. */
export function placeholder(kind, title, text) {
  return element('div', { class: 'placeholder', 'data-kind': kind }, element('p', { class: 'placeholder-title' }, title),
    text && element('p', {}, text));
}

/** Pause in typing after which a search applies. */
const typingMs = 300;

/** A field for a text to search; `changed(text)` is called when the reader pauses. { node, stop() } */
export function searchField(label, value, changed) {
  let typing = 0;
  const field = element('input', {
    type: 'search', name: 'text', value, oninput: () => {
      clearTimeout(typing);
      typing = setTimeout(() => changed(field.value), typingMs);
    },
  });
  return { node: element('label', { class: 'data-search' }, element('span', {}, label), field), stop: () => clearTimeout(typing) };
}

/** The address of a view with the filled parts of a filter. */
export function addressOf(path, filter) {
  const filled = new URLSearchParams(Object.entries(filter).filter(([, value]) => value));
  return `#/${path}${String(filled) ? `?${filled}` : ''}`;
}

/**
 * A selection of one option, or of all where `all` is a word for it; { node, show(options), choose(value) } remembers the
 * choice.
 */
export function chooser(label, chosen, changed, all = words.calls.all) {
  let value = chosen;
  const select = element('select', { onchange: () => { value = select.value; changed(value); } });
  const node = element('label', {}, element('span', {}, label), select);
  let shown = '';
  return {
    node,
    show(options) {
      const each = all ? [['', all], ...options] : [...options];
      if (value && !options.some(([one]) => one === value)) {
        each.push([value, visible(value)]);
      }
      const fresh = JSON.stringify(each);
      if (fresh !== shown) {
        shown = fresh;
        replace(select, each.map(([one, word]) => element('option', { value: one, selected: one === value }, word)));
      }
    },
    choose(wanted) {
      value = wanted;
      shown = '';
    },
  };
}
