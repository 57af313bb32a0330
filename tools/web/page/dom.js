// Elements of the page. Text is inserted as text, never as markup, and without characters that change how other text is
// shown, so texts of programs, services and operators are shown literally.
//
//   element('p', { class: 'why' }, 'The gateway says: ', element('q', {}, reason))

const svgSpace = 'http://www.w3.org/2000/svg';

/** Escapes control characters and direction marks as the commands do: \x1b. */
export function visible(text) {
  return String(text ?? '').replace(/[\p{Cc}\u061c\u200e\u200f\u2028-\u202e\u2066-\u2069]/gu,
    (char) => (char < '\u0100' ? `\\x${char.charCodeAt(0).toString(16).padStart(2, '0')}` : `\\u${char.charCodeAt(0).toString(16).padStart(4, '0')}`));
}

/** Adds children: nodes directly, other values as text; null, undefined and false are left out. */
export function append(parent, children) {
  for (const child of children.flat(Infinity)) {
    if (child !== null && child !== undefined && child !== false) {
      parent.append(child instanceof Node ? child : document.createTextNode(visible(child)));
    }
  }
  return parent;
}

/**
 * A new element. `properties` are attributes; `onclick` and the like take functions; true sets an empty attribute,
 * false, null and undefined set none. There is no `style`: the page's policy allows none.
 */
export function element(tag, properties = {}, ...children) {
  return append(dress(document.createElement(tag), properties), children);
}

/** The same for SVG. */
export function drawing(tag, properties = {}, ...children) {
  return append(dress(document.createElementNS(svgSpace, tag), properties), children);
}

function dress(node, properties) {
  for (const [name, value] of Object.entries(properties)) {
    if (typeof value === 'function') {
      node.addEventListener(name.slice(2), value);
    } else if (value !== false && value !== null && value !== undefined) {
      setAttribute(node, name, value === true ? '' : value);
    }
  }
  return node;
}

export function replace(parent, ...children) {
  parent.replaceChildren();
  return append(parent, children);
}

/**
 * Shows the result of `make` in `parent`, and calls `make` again only when `key` changes: a click is lost if its element is
 * replaced between press and release.
 *
 *   const show = slot(buttons);
 *   show([call, user], () => buttonsFor(call));
 */
export function slot(parent) {
  let shown;
  return (key, make) => {
    const fresh = JSON.stringify(key);
    if (fresh !== shown) {
      shown = fresh;
      replace(parent, make());
    }
  };
}

/** Sets the text of a node only if it differs, which keeps the reader's selection. */
export function setText(node, text) {
  const shown = visible(text);
  if (node.textContent !== shown) {
    node.textContent = shown;
  }
}

/** Sets an attribute only if it differs. */
export function setAttribute(node, name, value) {
  const text = /^(title|aria-label)$/.test(name) ? visible(value) : String(value);
  if (value === null || value === undefined || value === false) {
    node.removeAttribute(name);
  } else if (node.getAttribute(name) !== text) {
    node.setAttribute(name, text);
  }
}

/**
 * Updates a list on the page without replacing existing elements: keyboard focus, selection and scroll position are kept.
 *
 *   const tiles = new Keyed(grid, (machine) => machineTile(machine));
 *   tiles.show(machines, (machine) => machine.name);     // in this order
 *
 * `make` returns { node, update(datum) }.
 */
export class Keyed {
  #parent;
  #make;
  #parts = new Map();

  constructor(parent, make) {
    this.#parent = parent;
    this.#make = make;
  }

  show(data, keyOf) {
    // Removed elements go first, so that the others rarely move: an element that is moved loses a click.
    const keep = new Set(data.map(keyOf));
    for (const [key, part] of this.#parts) {
      if (!keep.has(key)) {
        part.node.remove();
        this.#parts.delete(key);
      }
    }
    let before = this.#parent.firstElementChild;
    for (const datum of data) {
      const key = keyOf(datum);
      let part = this.#parts.get(key);
      if (!part) {
        part = this.#make(datum);
        this.#parts.set(key, part);
      }
      part.update(datum);
      if (part.node === before) {
        before = before.nextElementSibling;
      } else {
        this.#parent.insertBefore(part.node, before);
      }
    }
  }
}
