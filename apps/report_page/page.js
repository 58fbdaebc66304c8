// SPDX-License-Identifier: Apache-2.0
// Fills the page from its data. The address may say what to show: #colour=normal&maps=aop&view=NAME&theme=dark.
"use strict";

const byId = (id) => document.getElementById(id);
const say = (message, title = "Something went wrong on this page: ") =>
  byId("messages").append(element("p", { class: "callout" }, element("b", {}, title), message));
addEventListener("error", (event) => {
  document.documentElement.dataset.error = event.message;
  say(event.message);
});

const data = JSON.parse(byId("data").textContent);
const scan = data.scan;
const MAPS = [["s0", "S0"], ["dop", "DoP"], ["aop", "AoP"], ["depth", "Depth"], ["normal", "Normal"]];
const MAP_NAMES = { s0: "intensity S0", dop: "degree of polarization", aop: "angle of polarization",
                    depth: "depth", normal: "surface normals" };
const STAGES = { views: "Stokes views", sfm: "Camera poses", dense: "Undistortion", stereo: "Depth and normals",
                 fusion: "Cloud", mesh: "Mesh", report: "This page" };
const state = { map: "s0", colour: "", view: -1, all: false };
let viewer = null;

// --- words and numbers ---

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

// --- the page's head ---

function total() {
  return Object.values(scan.stages || {}).reduce((sum, stage) => sum + (stage.seconds || 0), 0);
}

function fillTiles() {
  const views = scan.views || {}, tiles = [];
  const tile = (name, value, unit = "") =>
    tiles.push(element("dl", { class: "tile" }, element("dt", {}, name), element("dd", {}, value, element("small", {}, " " + unit))));
  const points = data.cloud?.total ?? scan.cloud?.points;
  if (points !== undefined) tile("Points", ...short(points));
  if (views.registered !== undefined)
    tile("Views with a pose", count(views.registered), views.total ? "of " + count(views.total) : "");
  else tile("Views", count(views.total ?? data.views.length));
  if (scan.mesh?.faces) tile("Mesh faces", ...short(scan.mesh.faces));
  const polarized = data.dop_full > 0 || views.polarized === true;
  tile("Polarization", polarized ? "Yes" : "No", data.dop_full ? "DoP to about " + plain(data.dop_full) : "");
  const depths = data.views.filter((view) => view.depth);
  if (depths.length)
    tile("Pixels with depth", plain((100 * depths.reduce((sum, view) => sum + view.depth.share, 0)) / depths.length), "%");
  if (total()) tile("Computing time", duration(total()));
  byId("tiles").append(...tiles);
}

function fillMessages() {
  const list = (title, items, style) => {
    if (!items.length) return;
    const summary = element("summary", {}, element("b", {}, title), element("span", {}, ` · ${items.length}`));
    byId("messages").append(element("details", { class: "callout " + style, open: items.length <= 4 && "" }, summary,
      element("ul", {}, ...items.map((item) => element("li", {}, item)))));
  };
  const warnings = [...(scan.warnings || []), ...Object.values(scan.stages || {}).flatMap((stage) => stage.warnings || [])];
  list("Warnings", [...new Set(warnings)].map(String), "");
  list("Not in this scan", data.notes, "plain");
}

// --- the cloud ---

// Cuts the cloud's bytes into its parts (apps/report_cloud.h).
function readCloud() {
  if (!data.cloud) return null;
  const bytes = bytesOf(byId("cloud").textContent), cloud = { ...data.cloud, count: data.cloud.shown, parts: {} };
  cloud.positions = new Uint16Array(bytes.buffer, 0, 3 * cloud.count);
  let offset = 6 * cloud.count;
  for (const layer of cloud.layers) {
    const size = cloud.count * (layer.key === "colour" || layer.key === "normal" ? 3 : 1);
    cloud.parts[layer.key] = bytes.subarray(offset, (offset += size));
  }
  return cloud;
}

function pointColours(cloud, key) {
  const colours = new Uint8Array(4 * cloud.count).fill(160), part = cloud.parts[key];
  const normals = key === "normal" && new Int8Array(part.buffer, part.byteOffset, part.length);
  const palette = palettes[key === "dop" ? "heat" : "ramp"];
  for (let i = 0; part && i < cloud.count; ++i)
    for (let k = 0; k < 3; ++k)
      colours[4 * i + k] = key === "colour" ? part[3 * i + k] : normals ? 127.5 + normals[3 * i + k] : palette[3 * part[i] + k];
  return colours;
}

// A ball coloured like the points' normals, as seen from where the eye is now.
function paintBall(canvas, axes) {
  const size = canvas.width, context = canvas.getContext("2d"), image = context.createImageData(size, size);
  for (let y = 0; y < size; ++y)
    for (let x = 0; x < size; ++x) {
      const u = (2 * x + 1) / size - 1, v = 1 - (2 * y + 1) / size, rest = 1 - u * u - v * v;
      if (rest < 0) continue;
      const normal = add(add(scale(axes.right, u), scale(axes.up, v)), scale(axes.back, Math.sqrt(rest)));
      for (let k = 0; k < 3; ++k) image.data[4 * (y * size + x) + k] = 127.5 * (1 + normal[k]);
      image.data[4 * (y * size + x) + 3] = 255;
    }
  context.putImageData(image, 0, 0);
}

function showColour(key) {
  const layer = data.cloud?.layers.find((each) => each.key === key) ?? data.cloud?.layers[0];
  if (!layer || !viewer) return;
  state.colour = layer.key;
  viewer.setColours(pointColours(viewer.cloud, layer.key));
  const legend = byId("legend");
  if (layer.key === "normal") {
    const canvas = element("canvas", { width: 96, height: 96 });
    legend.replaceChildren(element("span", { class: "dial", role: "img", "aria-label": "A ball coloured like the normals, as seen from here" }, canvas));
    paintBall(canvas, viewer.axes());
  } else if (layer.key === "colour") legend.replaceChildren();
  else legend.replaceChildren(layer.label + " ", ramp(layer.key === "dop" ? "heat" : "ramp", plain(layer.low), plain(layer.high)));
  press("colours", layer.key);
}

function startViewer() {
  const cameras = data.views.map((view) => view.camera ?? null), empty = byId("empty");
  if (!data.cloud && !cameras.some(Boolean)) {
    empty.textContent = "This scan has no cloud and no camera poses yet.";
    empty.hidden = false;
    byId("canvas").hidden = true;
    return;
  }
  try {
    viewer = new Viewer(byId("canvas"), readCloud(), cameras, {
      select: (index) => select(index),
      step: (by) => select((state.view + by + data.views.length) % data.views.length),
      hover: showLabel,
      turn: (axes) => {
        const canvas = document.querySelector("#legend canvas");
        if (canvas) paintBall(canvas, axes);
      },
    });
  } catch (error) {
    empty.textContent = error.message;
    empty.hidden = false;
    return;
  }
  segments("colours", (data.cloud?.layers ?? []).map((layer) => [layer.key, layer.label]), showColour);
  if (data.cloud && data.cloud.shown < data.cloud.total) {
    const outside = data.cloud.outside ? `; ${count(data.cloud.outside)} of the sample far outside are left out` : "";
    byId("help").prepend(`Shown: ${count(data.cloud.shown)} of ${count(data.cloud.total)} points${outside}. `);
  }
}

function showLabel(index, x, y) {
  const label = byId("label");
  label.hidden = index < 0;
  if (index < 0) return;
  label.textContent = data.views[index].name;
  [label.style.left, label.style.top] = [x + "px", Math.max(y, 40) + "px"];
}

// --- groups of buttons of which one is pressed ---

function segments(id, entries, choose) {
  byId(id).replaceChildren(...entries.map(([key, label]) =>
    element("button", { type: "button", "data-key": key, "aria-pressed": "false", onclick: () => choose(key) }, label)));
}
function press(id, key) {
  for (const button of byId(id).children) button.setAttribute("aria-pressed", String(button.dataset.key === key));
}

// --- the selected view ---

const picturesOf = (view) => MAPS.filter(([key]) => view.pictures[key]);

function select(index) {
  state.view = index;
  showSelected();
  for (const button of byId("gallery").children) button.setAttribute("aria-pressed", String(Number(button.dataset.index) === index));
  if (!viewer) return;
  viewer.select(index, null);
  const view = data.views[index], image = new Image();
  if (!view.pictures.s0) return;
  image.onload = () => state.view === index && viewer.select(index, image);
  image.src = jpeg(view.pictures.s0);
}

function factsOf(view) {
  const facts = [];
  if (view.depth) {
    facts.push(["Depth", `${plain(view.depth.near)} to ${plain(view.depth.far)} (world units)`]);
    facts.push(["Pixels with depth", plain(100 * view.depth.share) + " %"]);
  }
  if (view.source_names) facts.push(["Matched with", view.source_names.slice(0, 6).join(", ") + (view.source_names.length > 6 ? ", ..." : "")]);
  if (!view.camera) facts.push(["Pose", "not known"]);
  return facts;
}

function showSelected() {
  const view = data.views[state.view], box = byId("selected");
  if (!view) return void box.replaceChildren(element("h2", { id: "selected-name" }, "No views yet"));
  const step = (by, label, text) => element("button", { type: "button", "aria-label": label,
    onclick: () => select((state.view + by + data.views.length) % data.views.length) }, text);
  const has = picturesOf(view), shown = view.pictures[state.map] ? state.map : has[0]?.[0];
  const parts = [element("div", { class: "bar" }, element("h2", { id: "selected-name", title: view.name }, view.name),
    step(-1, "Previous view", "‹"), step(1, "Next view", "›"))];
  if (shown) parts.push(element("img", { class: "big", src: jpeg(view.pictures[shown]), alt: `${MAP_NAMES[shown]} of view ${view.name}` }));
  else parts.push(element("p", { class: "soft" }, "This view has no pictures here."));
  parts.push(element("div", { class: "strip" }, ...has.map(([key, label]) =>
    element("button", { type: "button", "aria-pressed": String(key === shown), onclick: () => showMap(key) },
      element("img", { src: jpeg(view.pictures[key]), alt: "" }), label))));
  parts.push(element("dl", { class: "facts" }, ...factsOf(view).flatMap(([name, value]) => [element("dt", {}, name), element("dd", {}, value)])));
  if (viewer && view.camera)
    parts.push(element("button", { type: "button", class: "more", onclick: () => viewer.lookThrough(state.view) }, "Look through this camera"));
  box.replaceChildren(...parts);
}

// --- all views ---

const FIRST = 24;

function mapLegend(key) {
  const words = (text) => element("span", { class: "words" }, text);
  if (key === "dop") return [ramp("heat", "0", plain(data.dop_full)), words("Degree of polarization")];
  if (key === "aop") return [wheel(), words("Angle of polarization, anticlockwise from the right. Darker: less polarized.")];
  if (key === "depth") return [ramp("ramp", "far", "near"), words("Each view has a range of its own.")];
  if (key === "normal") return [ball(), words("Normals as the camera sees them; light blue faces it.")];
  return [];
}

function showMap(key) {
  state.map = key;
  press("maps", key);
  byId("map-legend").replaceChildren(...mapLegend(key));
  const shown = state.all ? data.views : data.views.slice(0, FIRST);
  byId("gallery").replaceChildren(...shown.map((view, index) => element("button", { type: "button", "data-index": index,
      "aria-pressed": String(index === state.view), "aria-label": `View ${view.name}: ${MAP_NAMES[key]}`, onclick: () => select(index) },
    view.pictures[key] ? element("img", { src: jpeg(view.pictures[key]), alt: "", loading: "lazy" }) : element("span", { class: "none" }, "none"),
    element("span", {}, view.name))));
  const more = byId("more");
  more.hidden = state.all || data.views.length <= FIRST;
  more.textContent = `Show all ${count(data.views.length)} views`;
  showSelected();
}

// --- stages and settings ---

const byStage = (a, b) => Object.keys(STAGES).indexOf(a[0]) - Object.keys(STAGES).indexOf(b[0]);

// What a stage counted, the totals first: "3,059 points · 10 views · mean confidence 0.47".
function countsOf(stage) {
  const numbers = Object.entries(stage.counts || {}).filter(([, value]) => typeof value === "number");
  const whole = (entry) => Number.isInteger(entry[1]);
  return [...numbers.filter(whole).map(([key, value]) => `${count(value)} ${key.replaceAll("_", " ")}`),
          ...numbers.filter((entry) => !whole(entry)).map(([key, value]) => `${key.replaceAll("_", " ")} ${plain(value)}`)].join(" · ");
}

function fillStages() {
  const stages = Object.entries(scan.stages || {}).filter(([name]) => name !== "report");
  if (!stages.length) return byId("stages").append(element("p", { class: "soft" }, "No stage has run yet."));
  const longest = Math.max(...stages.map(([, stage]) => stage.seconds || 0), 1e-9);
  stages.sort(byStage);
  byId("stages").append(element("table", { class: "stages" }, ...stages.map(([name, stage]) => {
    const bar = element("i");
    bar.style.width = (100 * (stage.seconds || 0)) / longest + "%";
    const done = stage.state === "done";
    return element("tr", {}, element("th", { scope: "row" }, STAGES[name] ?? name, " ",
        element("span", { class: done ? "soft" : "failed" }, done ? countsOf(stage) : [stage.state ?? "not run", stage.error].filter(Boolean).join(": ")),
        element("div", { class: "meter" }, bar)),
      element("td", { class: "time" }, stage.seconds === undefined ? "" : duration(stage.seconds)));
  })));
}

// Rows of [name, text] of nested settings.
function flatten(value, name = "") {
  if (value && typeof value === "object" && !Array.isArray(value))
    return Object.entries(value).flatMap(([key, inner]) => flatten(inner, name ? `${name}: ${key}` : key));
  const text = { boolean: () => (value ? "yes" : "no"), number: () => String(Number(value.toPrecision(6))), string: () => value || '""' };
  return [[name, (text[typeof value] ?? (() => JSON.stringify(value)))()]];
}

function fillSettings() {
  const stages = Object.entries(scan.options || {}).map(([name, options]) => [name, flatten(options)]).filter(([, rows]) => rows.length);
  stages.sort(byStage);
  if (!stages.length) byId("settings").append(element("p", { class: "soft" }, "The scan names no settings."));
  byId("settings").append(...stages.map(([name, rows]) => element("details", {},
    element("summary", {}, STAGES[name] ?? name, element("span", {}, ` · ${rows.length}`)),
    element("table", {}, ...rows.map(([key, value]) => element("tr", {}, element("th", { scope: "row" }, key), element("td", {}, value)))))));
  const facts = [scan.version && `polarscan ${scan.version}`, scan.input && `input ${scan.input}`, scan.options_hash && `options ${scan.options_hash}`];
  byId("foot").textContent = facts.filter(Boolean).join(" · ");
}

// --- what the address and the buttons say ---

function setTheme(theme) {
  document.documentElement.dataset.theme = theme;
  if (!viewer) return;
  viewer.dark = theme === "dark";
  viewer.draw();
}

function readAddress() {
  const wanted = new URLSearchParams(location.hash.slice(1));
  setTheme(wanted.get("theme") ?? (matchMedia("(prefers-color-scheme: dark)").matches ? "dark" : "light"));
  showColour(wanted.get("colour") ?? state.colour);
  const has = MAPS.filter(([key]) => data.views.some((view) => view.pictures[key])).map(([key]) => key);
  showMap(has.includes(wanted.get("maps")) ? wanted.get("maps") : has.includes(state.map) ? state.map : has[0]);
  const named = data.views.findIndex((view) => view.name === wanted.get("view"));
  if (data.views.length) select(named >= 0 ? named : Math.max(state.view, 0));
}

function listenToButtons() {
  byId("theme").onclick = () => setTheme(document.documentElement.dataset.theme === "dark" ? "light" : "dark");
  byId("more").onclick = () => {
    state.all = true;
    showMap(state.map);
  };
  addEventListener("hashchange", readAddress);
  if (!viewer) return document.querySelector(".tools").remove();
  byId("reset").onclick = () => viewer.goHome(true);
  byId("point-size").oninput = (event) => {
    viewer.point_scale = 2 ** event.target.value;
    viewer.draw();
  };
  byId("cameras").onclick = (event) => {
    viewer.show_cameras = !viewer.show_cameras;
    event.target.setAttribute("aria-pressed", String(viewer.show_cameras));
    viewer.draw();
  };
  const box = document.querySelector(".view3d");
  byId("fullscreen").hidden = !document.fullscreenEnabled;
  byId("fullscreen").onclick = () => (document.fullscreenElement ? document.exitFullscreen() : box.requestFullscreen());
}

byId("name").textContent = data.name;
fillTiles();
fillMessages();
startViewer();
segments("maps", MAPS.filter(([key]) => data.views.some((view) => view.pictures[key])), showMap);
listenToButtons();
readAddress();
fillStages();
fillSettings();
document.documentElement.dataset.ready = "yes";
