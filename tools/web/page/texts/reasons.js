// Sentences of the fabric in other words. {} stands for a value; the new sentence has the values in the same order, or with
// a number ({1}). A value that is such a sentence itself is put in other words, too. The first sentence that fits counts:
// the more exact ones stand first.
const escaped = (text) => text.replace(/[.*+?^${}()|[\]\\]/g, '\\$&');

/** A function of a sentence: it in other words; empty if no pair fits. */
export function rewording(pairs) {
  const patterns = pairs.map(([from, to]) => [new RegExp(`^${from.split('{}').map(escaped).join('(.+?)')}$`, 's'), to]);
  return function reword(sentence) {
    for (const [pattern, to] of patterns) {
      const found = pattern.exec(sentence);
      if (found) {
        const values = found.slice(1).map((value) => reword(value) || value);
        let next = 0;
        return to.replace(/\{(\d?)\}/g, (_, number) => values[number === '' ? next++ : Number(number)]);
      }
    }
    return '';
  };
}
