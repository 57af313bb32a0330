// Sentences of the fabric in a language: by their code, or by their English text as long as they have none.

/**
 * Returns a function that says a sentence: a text, or { text, code, arguments }, whose arguments are the same. `messages` has
 * the sentences by their code, `reword` those without one; the result is empty if neither has it.
 */
export const sayer = (messages, reword) => function say(sentence) {
  if (typeof sentence === 'string' || !messages[sentence.code]) {
    return reword(sentence.text ?? sentence);
  }
  return messages[sentence.code].replace(/\{(\d)\}/g, (_, number) => {
    const value = sentence.arguments?.[number] ?? '';
    return say(value) || (value.text ?? value);
  });
};

/** A sentence of the server's JSON, where its code and its arguments stand beside it. */
export const messageOf = (from, name) => (from[`${name}_code`]
  ? { text: from[name], code: from[`${name}_code`], arguments: from[`${name}_arguments`] } : from[name] ?? '');

/** In English. */
export const textOf = (sentence) => sentence?.text ?? sentence ?? '';
