// Rewords or translates sentences of the fabric. {} stands for a value; the new sentence has the values in the same order, or
// with a number ({1}). Values that match a sentence are reworded, too. Of several matching sentences, the longest counts.
const escaped = (text) => text.replace(/[.*+?^${}()|[\]\\]/g, '\\$&');

/** Returns a function that rewords a sentence; its result is empty if no pair matches. */
export function rewording(pairs) {
  const fixed = ([from]) => from.replaceAll('{}', '').length;
  const patterns = [...pairs].sort((a, b) => fixed(b) - fixed(a)).map(([from, to]) => [new RegExp(`^${from.split('{}').map(escaped).join('(.+?)')}$`, 's'), to]);
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
