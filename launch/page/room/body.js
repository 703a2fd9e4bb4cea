// Draws the bodies of robots on a canvas. Units are CSS pixels of the canvas; `p` is the projection from meters.

import { FULL_TURN, words } from "./paint.js";

/** The least radius of a robot, px, also in a crowd. */
export const LEAST_PX = 5;
export const CROWDED_PX = 3.5;
/** From this radius on, px, a body has a sign. */
const SIGN_PX = 8;
/** The number of directions and the largest number of stored images of small bodies. */
const DIRECTIONS = 64;
const MAX_IMAGES = 4096;
/** The length of the nose that shows the heading, in radii. */
const NOSE = 1.55;

/** Draws nose and disc of a body at the origin, heading to the right. */
function paintShape(c, radius, color, ink) {
  c.fillStyle = color;
  c.strokeStyle = ink;
  c.lineWidth = radius < 5 ? 1 : 1.5;
  c.beginPath();
  c.moveTo(radius * NOSE, 0);
  c.lineTo(radius * 0.8, radius * 0.55);
  c.lineTo(radius * 0.8, -radius * 0.55);
  c.closePath();
  c.fill();
  c.stroke();
  c.beginPath();
  c.arc(0, 0, radius, 0, FULL_TURN);
}

const images = new Map();

/** Returns an image of a small body. A large team is drawn faster from images than from paths. */
function bodyImage(radius, direction, color, ink) {
  const key = [radius, devicePixelRatio, direction, color, ink].join();
  const known = images.get(key);
  if (known) return known;
  const half = Math.ceil((NOSE * radius + 1) * devicePixelRatio);
  const canvas = new OffscreenCanvas(2 * half, 2 * half);
  const c = canvas.getContext("2d");
  c.translate(half, half);
  c.scale(devicePixelRatio, devicePixelRatio);
  c.rotate((-direction * FULL_TURN) / DIRECTIONS);
  paintShape(c, radius, color, ink);
  c.fill();
  c.stroke();
  if (images.size >= MAX_IMAGES) images.clear();
  images.set(key, canvas.transferToImageBitmap());
  return images.get(key);
}

/** Draws a robot's body with heading, color and sign. A dead one is crossed out, a silent one hatched, a joining one dashed. */
export function paintBody(c, p, robot, style, palette) {
  const [x, y] = [p.x(robot.pose.position[0]), p.y(robot.pose.position[1])];
  const radius = Math.max(style.least_px, p.scale * style.radius_m);
  const isDead = robot.state === "dead";
  if (style.isSelected) {
    c.strokeStyle = palette.select;
    c.lineWidth = 3;
    c.beginPath();
    c.arc(x, y, radius + 5, 0, FULL_TURN);
    c.stroke();
  }
  if (robot.state === "present" && radius < SIGN_PX) {
    const direction = Math.round((robot.pose.heading_rad / FULL_TURN) * DIRECTIONS) % DIRECTIONS;
    const image = bodyImage(radius, direction, style.color, palette.ink);
    const size = image.width / devicePixelRatio;
    c.drawImage(image, x - size / 2, y - size / 2, size, size);
    return;
  }
  c.save();
  c.translate(x, y);
  c.save();
  c.rotate(-robot.pose.heading_rad);
  paintShape(c, radius, isDead ? palette["ink-2"] : style.color, palette.ink);
  c.globalAlpha = isDead ? 0.45 : robot.state === "coming" ? 0.4 : 1;
  c.fill();
  c.globalAlpha = 1;
  c.setLineDash(robot.state === "coming" ? [3, 3] : []);
  c.stroke();
  c.setLineDash([]);
  c.restore();
  if (robot.state === "silent") {
    c.save();
    c.beginPath();
    c.arc(0, 0, radius, 0, FULL_TURN);
    c.clip();
    c.strokeStyle = palette.floor;
    c.lineWidth = 2;
    c.beginPath();
    for (let at = -2 * radius; at < 2 * radius; at += 5) {
      c.moveTo(at, radius);
      c.lineTo(at + 2 * radius, -radius);
    }
    c.stroke();
    c.restore();
  }
  if (isDead) {
    c.strokeStyle = palette.bad;
    c.lineWidth = 3;
    c.beginPath();
    c.moveTo(-radius, -radius);
    c.lineTo(radius, radius);
    c.moveTo(radius, -radius);
    c.lineTo(-radius, radius);
    c.stroke();
  } else if (radius >= SIGN_PX && robot.state !== "silent") {
    const size = Math.min(14, Math.round((style.sign.length > 1 ? 0.95 : 1.2) * radius));
    words(c, style.sign, 0, 0.5, { color: "#fff", bold: true, size, outline: "rgba(0,0,0,.55)" });
  }
  c.restore();
}
