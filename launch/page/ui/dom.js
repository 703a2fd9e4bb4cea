// Creation and change of elements. Data enters the document as text and attributes only, never as HTML.

/** Creates an element. Attributes `on…` are listeners. Null, undefined and false attributes are left out. */
export function el(tag, attributes = {}, ...children) {
  const element = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (name.startsWith("on")) element.addEventListener(name.slice(2), value);
    else attribute(element, name, value);
  }
  element.append(...children.filter((child) => child !== null && child !== undefined));
  return element;
}

/** Sets a text only if it differs, so that a selection and the layout stay. */
export function text(element, value) {
  const wanted = String(value);
  if (element.textContent !== wanted) element.textContent = wanted;
}

/** Sets an attribute only if it differs. Null, undefined and false remove it. */
export function attribute(element, name, value) {
  if (value === null || value === undefined || value === false) {
    if (element.hasAttribute(name)) element.removeAttribute(name);
    return;
  }
  const wanted = value === true ? "" : String(value);
  if (element.getAttribute(name) !== wanted) element.setAttribute(name, wanted);
}

/** Creates the colored dot of a robot, which stands next to its name. */
export function dot(color) {
  return el("span", { class: "dot", style: `background:${color}` });
}

const kept = new WeakMap();

/**
 * Makes the children of `parent` match `items`, in their order. Elements of remaining items are kept, with focus and
 * scroll position. `create(item)` returns a new element, `update(element, item)` updates any element.
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

export function byId(id) {
  return document.getElementById(id);
}
