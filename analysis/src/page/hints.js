// Shows the hint of the nearest mark of a figure at once: for a pointer, for a finger, and for the arrow keys. Without the
// script, the browser shows the hint of the mark under the pointer after a while.
const FAR_PX = 40;
const box = document.createElement("output");
box.className = "hint";
box.hidden = true;
document.body.append(box);
let shown = null;

function show(mark) {
  shown?.removeAttribute("class");
  shown = mark;
  box.hidden = !mark;
  if (!mark) return;
  mark.setAttribute("class", "shown");
  box.value = mark.getAttribute("aria-label");
  box.style.left = "0";
  const at = mark.getBoundingClientRect();
  const size = box.getBoundingClientRect();
  const left = at.left + at.width / 2 - size.width / 2;
  box.style.left = `${Math.max(4, Math.min(left, document.documentElement.clientWidth - size.width - 4))}px`;
  box.style.top = `${at.top > size.height + 8 ? at.top - size.height - 6 : at.bottom + 6}px`;
}

/** Returns the distance of a point from a mark, and from its center. */
function distances(mark, x, y) {
  const at = mark.getBoundingClientRect();
  const outside = (value, from, to) => Math.max(from - value, 0, value - to);
  const [dx, dy] = [x - (at.left + at.right) / 2, y - (at.top + at.bottom) / 2];
  return [Math.hypot(outside(x, at.left, at.right), outside(y, at.top, at.bottom)), Math.hypot(dx, dy)];
}

for (const drawing of document.querySelectorAll(".drawing")) {
  const marks = [...drawing.querySelectorAll("rect > title")].map((title) => {
    const mark = title.parentElement;
    mark.setAttribute("role", "img");
    mark.setAttribute("aria-label", title.textContent);
    title.remove();
    return mark;
  });
  const title = drawing.querySelector("svg > title");
  if (!marks.length || !title) continue;
  drawing.setAttribute("aria-label", `${title.textContent}; left and right arrow: values`);
  title.remove();
  // The marks are images of their own.
  const svg = drawing.querySelector("svg");
  svg.removeAttribute("role");
  const point = ({ clientX, clientY }) => {
    const near = marks.map((mark) => ({ mark, at: distances(mark, clientX, clientY) }));
    const nearest = near.reduce((a, b) => ((b.at[0] - a.at[0] || b.at[1] - a.at[1]) < 0 ? b : a));
    show(nearest.at[0] <= FAR_PX ? nearest.mark : null);
  };
  drawing.addEventListener("pointermove", point);
  drawing.addEventListener("pointerdown", point);
  drawing.addEventListener("pointerleave", ({ pointerType }) => pointerType === "mouse" && show(null));
  drawing.addEventListener("blur", () => show(null));
  drawing.addEventListener("keydown", (event) => {
    const step = { ArrowRight: 1, ArrowLeft: -1 }[event.key];
    if (!step) return;
    event.preventDefault();
    // A choice may show only a part of the drawing.
    const { top, bottom } = svg.getBoundingClientRect();
    const visible = marks.filter((mark) => {
      const at = mark.getBoundingClientRect();
      return at.bottom > top && at.top < bottom;
    });
    const at = visible.indexOf(shown);
    const mark = visible[at < 0 ? 0 : Math.max(0, Math.min(at + step, visible.length - 1))];
    mark.scrollIntoView({ block: "nearest", inline: "nearest" });
    show(mark);
  });
}
document.addEventListener("keydown", ({ key }) => key === "Escape" && show(null));
document.addEventListener("scroll", () => show(shown), { capture: true, passive: true });
