// Places labels where they cover no other label and no body. Units are CSS pixels of the canvas.

/** The space around a label that was not in the previous picture, px, so that labels do not flicker. */
const NEW_LABEL_PX = 3;

/** Tests whether two boxes `{left, top, right, bottom}` overlap. */
export function overlaps(a, b) {
  return a.left < b.right && b.left < a.right && a.top < b.bottom && b.top < a.bottom;
}

/** Returns a box with this space around it, px. */
export function grown({ left, top, right, bottom }, space) {
  return { left: left - space, top: top - space, right: right + space, bottom: bottom + space };
}

/**
 * Returns the place of a label next to a body as `{index, side, box}`: the index of its text in `sizes`, `{width, height}`
 * of the wanted text and of shorter ones. The side is below, above, right or left of the body, within the `walls`, over no box
 * in `taken`, and over as few as possible in `covered`. The `side` of the previous picture has priority, so that labels do not
 * jump; null: there was no label. Without a free side the result is null, unless the label `mustShow`. A body out of sight has
 * no label.
 */
export function placeLabel(sizes, { x, y, gap }, { side, mustShow }, walls, taken, covered) {
  const point = { left: x, top: y, right: x, bottom: y };
  if (!overlaps(grown(walls, gap), point)) return null;
  const around = side === null ? NEW_LABEL_PX : 0;
  // In a large team most boxes are far away.
  const reach = gap + around + Math.max(...sizes.flatMap(({ width, height }) => [width, height]));
  const region = grown(point, reach);
  const [nearTaken, nearCovered] = [taken, covered].map((boxes) => boxes.filter((other) => overlaps(other, region)));
  const sides = [...new Set([side ?? 0, 0, 1, 2, 3])];
  for (const [index, { width, height }] of sizes.entries()) {
    const inside = Math.max(walls.left, Math.min(x - width / 2, walls.right - width));
    const corners = [
      [inside, y + gap],
      [inside, y - gap - height],
      [x + gap, y - height / 2],
      [x - gap - width, y - height / 2],
    ];
    const places = sides.map((each) => {
      const [left, top] = corners[each];
      return { index, side: each, box: { left, top, right: left + width, bottom: top + height } };
    });
    const free = places.filter(({ box }) => {
      const isInside = box.left >= walls.left && box.top >= walls.top && box.right <= walls.right && box.bottom <= walls.bottom;
      return isInside && !nearTaken.some((other) => overlaps(other, grown(box, around)));
    });
    const covers = ({ box }) => nearCovered.filter((other) => overlaps(other, box)).length;
    if (free.length > 0) return free.reduce((best, each) => (covers(each) < covers(best) ? each : best));
    if (mustShow && index === sizes.length - 1) return places[0];
  }
  return null;
}
