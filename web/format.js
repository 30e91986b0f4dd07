// Numbers as a person reads them: as many digits as the uncertainty deserves and no more.

import { t } from "./i18n.js";

const UNITS = { deg: [1, "°"], mil: [6400 / 360, " mil"], gon: [400 / 360, " gon"] };
const two = (number) => String(number).padStart(2, "0");

/** How many decimals a value deserves whose uncertainty (2 sigma) has two significant digits. */
export function decimals(uncertainty) {
  if (!(uncertainty > 0)) return 3;
  return Math.max(0, Math.min(9, 1 - Math.floor(Math.log10(uncertainty.toPrecision(2)))));
}

/** Give an azimuth and its 2 sigma in the chosen unit: `{value, sigma, sign}`, the sign where both share one. */
export function azimuth(azimuthDeg, sigmaDeg, units = "deg") {
  if (units === "dms") return sexagesimal(azimuthDeg * 3600, 7200 * sigmaDeg);
  const [scale, sign] = UNITS[units];
  const u = 2 * sigmaDeg * scale;
  const places = decimals(u);
  const value = Number((azimuthDeg * scale).toFixed(places)) % (360 * scale); // 359.9996 is 0.000, not 360.000
  return { value: value.toFixed(places), sign, sigma: `±${places ? u.toFixed(places) : Number(u.toPrecision(2))}` };
}

function sexagesimal(azimuth_s, u_s) {
  const sigma_s = Number(u_s.toPrecision(2));
  const step_s = 10 ** Math.floor(Math.log10(sigma_s || 1) - 1);
  const places = Math.max(0, -Math.round(Math.log10(step_s)));
  const [d, m, s] = parts((Math.round(azimuth_s / step_s) * step_s) % 1296000, places);
  const sigma = parts(sigma_s, places).map((part, k) => (Number(part) ? `${part}${"°′″"[k]}` : "")).filter(Boolean).join(" ");
  return { value: `${d}° ${two(m)}′ ${s.padStart(2 + (places && places + 1), "0")}″`, sign: "", sigma: `±${sigma}` };
}

function parts(seconds, places) {
  const whole = Number(seconds.toFixed(places));
  return [Math.floor(whole / 3600), Math.floor(whole / 60) % 60, (whole % 60).toFixed(places)];
}

/** Write an uncertainty given as one sigma in degrees as `±` 2 sigma. */
export function plusMinus(sigmaDeg, units) {
  if (!(sigmaDeg > 0)) return "–";
  const { sigma, sign } = azimuth(0, sigmaDeg, units);
  return sigma + sign;
}

/** A positive number with so many digits: "0.000998", "9.94·10⁻⁶". */
export function digits(value, places = 3) {
  if (value >= 1e-4 && value < 1e5) return value >= 10 ** places ? String(Number(value.toPrecision(places))) : value.toPrecision(places);
  const [front, power] = value.toExponential(places - 1).split("e");
  return `${front}·10${[...power].map((one) => ({ "-": "⁻", "+": "" })[one] ?? "⁰¹²³⁴⁵⁶⁷⁸⁹"[one]).join("")}`;
}

/** The ends of an interval. */
export const interval = ({ lower, upper }) => (upper == null ? `> ${digits(lower)}` : `${digits(lower)} … ${digits(upper)}`);

/** A time to wait: "8 s", "2 min 40 s", "1 h 05 min". */
export function duration(seconds) {
  const s = Math.max(0, Math.round(seconds));
  const m = Math.floor(s / 60);
  if (!m) return t("{s} s", { s });
  return m < 60 ? t("{m} min {s} s", { m, s: two(s % 60) }) : t("{h} h {m} min", { h: Math.floor(m / 60), m: two(m % 60) });
}

/** The time of day of an ISO time, in the reader's own zone. */
export const clock = (iso) => new Date(iso).toLocaleTimeString("en-GB");

/** The locale of dates: day before month in English too, as everywhere but in one country. */
export const locale = () => (document.documentElement.lang === "en" ? "en-GB" : "zh-CN");

/** The day and the time of day of an ISO time, short. */
export const dayTime = (iso) => new Date(iso).toLocaleString(locale(), { day: "2-digit", month: "short", hour: "2-digit", minute: "2-digit" }).replace(",", "");

/** A latitude with its hemisphere: "40.000° N". */
export const latitude = (deg) => `${Math.abs(deg).toFixed(3)}° ${deg < 0 ? "S" : "N"}`;

/** An integer with thin spaces between its thousands. */
export const count = (number) => String(Math.round(number)).replace(/\B(?=(\d{3})+$)/g, "\u2009");

/** A number with a true minus sign. */
export const fixed = (value, places) => value.toFixed(places).replace("-", "−");

/** The same, five decimals and more in groups of three: "0.000 001". */
export const fine = (value, places) => fixed(value, places).replace(/\.\d+/, (part) => part.replace(/\d{3}(?=\d\d)/g, "$&\u2009"));

/** What the service said, as a sentence of its own. */
export const sentence = (words) => words[0].toUpperCase() + words.slice(1) + (/[.!?]$/.test(words) ? "" : ".");

/** A direction in [0, 360). */
export const wrap = (deg) => ((deg % 360) + 360) % 360;

/** The same direction, as near to `centre` as whole turns bring it. */
export const near = (deg, centre) => centre + wrap(deg - centre + 180) - 180;
