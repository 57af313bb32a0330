// A modal question.
//
//   await ask({ title, pairs, body, consequence, act: 'Answer cnc/1', perform })   // true if it was done
import { element, replace } from '../dom.js';
import { words } from '../words.js';
import { facts } from './marks.js';

let number = 0;

function open(title, ...content) {
  const id = `dialog-${(number += 1)}`;
  const dialog = element('dialog', { 'aria-labelledby': id }, element('h2', { id }, title), content);
  document.body.append(dialog);
  const closed = new Promise((resolve) => {
    dialog.addEventListener('close', () => {
      dialog.remove();
      resolve(dialog.returnValue);
    });
  });
  dialog.showModal();
  return { dialog, closed };
}

/**
 * Shows an action and performs it when it is confirmed. `perform` resolves with nothing, with a text that is shown at the
 * end, or with { refused: text }; an exception is shown, and the question stays open.
 */
export async function ask({ title, pairs = [], body = [], consequence = '', act, perform }) {
  const said = element('p', { class: 'dialog-said', role: 'status' });
  const confirm = element('button', { type: 'submit', class: 'act', 'data-confirm': true }, act);
  const cancel = element('button', { type: 'button', onclick: () => dialog.close('') }, words.actions.cancel);
  const form = element('form', { method: 'dialog' },
    pairs.length > 0 && facts('dialog-facts', pairs),
    body,
    consequence && element('p', { class: 'consequence' }, element('span', { class: 'label' }, words.actions.consequence), consequence),
    said,
    element('div', { class: 'buttons' }, cancel, confirm));
  form.addEventListener('submit', async (event) => {
    event.preventDefault();
    confirm.disabled = true;
    replace(said, words.actions.sending);
    try {
      const end = await perform();
      if (end === undefined) {
        dialog.close('done');
        return;
      }
      said.dataset.kind = end.refused ? 'refused' : 'done';
      replace(said, end.refused ?? end);
      confirm.remove();
      replace(cancel, words.actions.close);
      cancel.onclick = () => dialog.close(end.refused ? '' : 'done');
      cancel.focus();
    } catch (problem) {
      said.dataset.kind = 'refused';
      replace(said, problem.message);
      confirm.disabled = false;
    }
  });
  const { dialog, closed } = open(title, form);
  return (await closed) === 'done';
}

/** Shows a message and waits until it is closed. */
export async function tell(title, text) {
  const { dialog, closed } = open(title, element('p', {}, text),
    element('div', { class: 'buttons' }, element('button', { type: 'button', onclick: () => dialog.close('') }, words.actions.close)));
  await closed;
}
