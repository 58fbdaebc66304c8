// SPDX-License-Identifier: Apache-2.0
// The page's data and state, and what all its parts say things with: elements, numbers, legends, groups of buttons.

const byId = (id) => document.getElementById(id);
const say = (message, title = "Something went wrong on this page: ") =>
  byId("messages").append(element("p", { class: "callout" }, element("b", {}, title), message));
addEventListener("error", (event) => {
  document.documentElement.dataset.error = event.message;
  say(event.message);
});

const data = JSON.parse(byId("data").textContent);
const scan = data.scan;
const MAPS = [["s0", "S0"], ["dop", "DoP"], ["aop", "AoP"], ["depth", "Depth"], ["normal", "Normal"],
              ["depth_error", "Depth error"], ["normal_error", "Normal error"]];
const MAP_NAMES = { s0: "intensity S0", dop: "degree of polarization", aop: "angle of polarization",
                    depth: "depth", normal: "surface normals", depth_error: "error of the depth",
                    normal_error: "error of the normals" };
const STAGES = { views: "Stokes views", sfm: "Camera poses", dense: "Undistortion", stereo: "Depth and normals",
                 fusion: "Cloud", mesh: "Mesh", report: "This page" };
const state = { map: "s0", colour: "", shape: "", view: -1, all: false };
let viewer = null;

function element(name, attributes = {}, ...children) {
  const made = document.createElement(name);
  for (const [key, value] of Object.entries(attributes)) {
    if (key.startsWith("on")) made.addEventListener(key.slice(2), value);
    else if (value !== false && value !== undefined) made.setAttribute(key, value);
  }
  made.append(...children);
  return made;
}
const plain = (number, digits = 3) => Number(number).toLocaleString("en", { maximumSignificantDigits: digits });
const count = (number) => Number(number).toLocaleString("en");
function short(number) {  // 1.23 M
  for (const [size, unit] of [[1e9, "G"], [1e6, "M"], [1e4, "k"]])
    if (number >= size) return [plain(number / (unit === "k" ? 1e3 : size)), unit];
  return [count(number), ""];
}
function duration(seconds) {
  if (seconds < 60) return plain(seconds, seconds < 10 ? 2 : 3) + " s";
  const s = Math.round(seconds), h = Math.floor(s / 3600), m = Math.floor((s % 3600) / 60);
  return h ? `${h} h ${String(m).padStart(2, "0")} min` : `${m} min ${String(s % 60).padStart(2, "0")} s`;
}
const bytesOf = (text) => Uint8Array.from(atob(text), (c) => c.charCodeAt(0));
const jpeg = (text) => "data:image/jpeg;base64," + text;
const palettes = { heat: bytesOf(data.legends.heat), ramp: bytesOf(data.legends.ramp) };

function ramp(palette, low, high) {
  const colours = palettes[palette], stops = [];
  for (let i = 0; i < 256; i += 15) stops.push(`rgb(${colours[3 * i]} ${colours[3 * i + 1]} ${colours[3 * i + 2]})`);
  const bar = element("i", { role: "presentation" });
  bar.style.background = `linear-gradient(to right, ${stops.join(",")})`;
  return element("span", { class: "ramp" }, low, bar, high);
}

function mark(text, left, top) {
  const span = element("span", {}, text);
  [span.style.left, span.style.top] = [left, top];
  return span;
}
const wheel = () => element("span", { class: "dial", role: "img",
    "aria-label": "Colour wheel of the angle of polarization: red is 0 and 180 degrees, cyan 90 degrees" },
  element("img", { src: jpeg(data.legends.wheel), alt: "" }),
  mark("0°", "128%", "50%"), mark("45°", "104%", "0%"), mark("90°", "50%", "-14%"), mark("135°", "-12%", "0%"),
  mark("180°", "-32%", "50%"));
const ball = () => element("span", { class: "dial", role: "img", "aria-label": "A ball coloured by its normals" },
  element("img", { src: jpeg(data.legends.ball), alt: "" }));

// --- groups of buttons of which one is pressed ---

function segments(id, entries, choose) {
  byId(id).replaceChildren(...entries.map(([key, label]) =>
    element("button", { type: "button", "data-key": key, "aria-pressed": "false", onclick: () => choose(key) }, label)));
}
function press(id, key) {
  for (const button of byId(id).children) button.setAttribute("aria-pressed", String(button.dataset.key === key));
}
