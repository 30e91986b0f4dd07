// The compass dial: north up, the wedge north so far with 2 sigma, the dots the directions measured.

import { $, s, write } from "./dom.js";

const R = 104;
const RAD = Math.PI / 180;
const at = (deg, r) => [(r * Math.sin(deg * RAD)).toFixed(2), (-r * Math.cos(deg * RAD)).toFixed(2)];
let placed = "";

/** Show north; a null azimuth is not known yet: the index mark is drawn up. */
export function showNorth({ azimuthDeg, sigmaDeg, factor, angles, states, label, note }) {
  const face = $("face");
  const up = azimuthDeg ?? 0;
  face.setAttribute("class", azimuthDeg === null ? "unknown" : "");
  face.setAttribute("aria-label", label);
  face.querySelector(".wedge").setAttribute("d", sector(up, 2 * sigmaDeg * factor));
  face.querySelector(".hand").setAttribute("transform", `rotate(${up.toFixed(3)})`);
  const dots = face.querySelector(".dots");
  place(dots, angles, up);
  states.forEach((state, k) => dots.children[k].setAttribute("class", `dot ${state}`));
  write(face.nextElementSibling, note);
}

/** Show where the gyro points now; NaN where nobody knows. */
export function showGyro(directionDeg, bad) {
  const gyro = $("face").querySelector(".gyro");
  const known = Number.isFinite(directionDeg);
  if (known) gyro.setAttribute("transform", `rotate(${directionDeg.toFixed(2)})`);
  gyro.setAttribute("class", `gyro ${known ? "" : "unknown"} ${bad ? "bad" : ""}`);
}

// Dots stand at azimuth minus table angle: the table turns counter-clockwise.
function place(dots, angles, azimuthDeg) {
  const key = `${angles.length} ${azimuthDeg}`;
  if (key === placed) return;
  placed = key;
  const r = Math.min(2.8, (2.4 * R) / angles.length);
  dots.replaceChildren(...angles.map((deg) => {
    const [cx, cy] = at(azimuthDeg - deg, R + 8);
    return s("circle", { cx, cy, r });
  }));
}

function sector(middle, half) {
  if (!(half > 0)) return "";
  if (half >= 180) return `M0 ${-R}a${R} ${R} 0 1 1 -.01 0Z`;
  return `M0 0L${at(middle - half, R)}A${R} ${R} 0 ${half > 90 ? 1 : 0} 1 ${at(middle + half, R)}Z`;
}
