// Sentences of the fabric in a language, by their code.

/** A process in a sentence: "square_root (pid 7 on hall)". */
const process = /^(.+) \(pid (\d+) on (.+)\)$/;

/**
 * Returns a function that says a sentence: a text, or { text, code, arguments }, whose arguments are the same. `messages` has
 * the sentences by their code, `processOf` says a process of a name, its number and a host; the result is empty if the
 * language has neither.
 */
export const sayer = (messages, processOf) => function say(sentence) {
  if (typeof sentence === 'string' || !messages[sentence.code]) {
    const found = process.exec(sentence.text ?? sentence);
    return found ? processOf(found[1], found[2], found[3]) : '';
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
