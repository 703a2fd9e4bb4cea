// Building and changing elements. Data reaches the document as text and attributes only, never as HTML.

/** A new element. Attributes named `on…` are listeners; those that are null, undefined or false are left out. */
export function el(tag, attributes = {}, ...children) {
  const element = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (name.startsWith("on")) element.addEventListener(name.slice(2), value);
    else attribute(element, name, value);
  }
  element.append(...children.filter((child) => child !== null && child !== undefined));
  return element;
}

/** Writes a text only where it changes, so that a selection in it and the layout stay. */
export function text(element, value) {
  const wanted = String(value);
  if (element.textContent !== wanted) element.textContent = wanted;
}

/** Sets an attribute where it changes; null, undefined and false take it away. */
export function attribute(element, name, value) {
  if (value === null || value === undefined || value === false) {
    if (element.hasAttribute(name)) element.removeAttribute(name);
    return;
  }
  const wanted = value === true ? "" : String(value);
  if (element.getAttribute(name) !== wanted) element.setAttribute(name, wanted);
}

/** A robot's color, always beside its name. */
export function dot(color) {
  return el("span", { class: "dot", style: `background:${color}` });
}

const kept = new WeakMap();

/**
 * Makes the children of `parent` those of `items`, in their order: elements of items that stay are kept, so that focus and
 * scrolling stay. `create(item)` gives a new element, `update(element, item)` brings any of them up to date.
 */
export function keyed(parent, items, keyOf, create, update) {
  const before = kept.get(parent) ?? new Map();
  const after = new Map();
  for (const item of items) {
    const key = keyOf(item);
    const element = before.get(key) ?? create(item);
    update?.(element, item);
    after.set(key, element);
  }
  for (const [key, element] of before) if (!after.has(key)) element.remove();
  let place = parent.firstChild;
  for (const element of after.values()) {
    if (element === place) place = place.nextSibling;
    else parent.insertBefore(element, place);
  }
  kept.set(parent, after);
}

/** The element with that id, which index.html has. */
export function byId(id) {
  return document.getElementById(id);
}
