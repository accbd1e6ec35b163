// Elements by hand: made once, then only what changed is written, so that focus and scroll stay where they are.

const SVG = "http://www.w3.org/2000/svg";

/** The element of an id. */
export const byId = (id) => document.getElementById(id);

/** An element with attributes and children; texts are texts, never markup. */
export function element(tag, attributes = {}, ...children) {
  return finish(document.createElement(tag), attributes, children);
}

/** An element of a drawing. */
export function shape(tag, attributes = {}, ...children) {
  return finish(document.createElementNS(SVG, tag), attributes, children);
}

function finish(made, attributes, children) {
  for (const [name, value] of Object.entries(attributes)) made.setAttribute(name, value);
  made.append(...children);
  return made;
}

/** Write a text where it differs. */
export function write(target, text) {
  if (target.textContent !== text) target.textContent = text;
}

/** Make the children of a list those of the items: one a key, in their order, each filled anew. */
export function fillList(list, items, keyOf, make, fill) {
  const known = new Map([...list.children].map((child) => [child.dataset.key, child]));
  items.forEach((item, place) => {
    const key = String(keyOf(item));
    let child = known.get(key);
    known.delete(key);
    if (!child) {
      child = make(item);
      child.dataset.key = key;
    }
    if (list.children[place] !== child) list.insertBefore(child, list.children[place] ?? null);
    fill(child, item);
  });
  for (const gone of known.values()) gone.remove();
}

/** A number with so many digits after the point, a dash for none. */
export const shown = (value, digits = 1) => (value === null || value === undefined ? "–" : value.toFixed(digits));
