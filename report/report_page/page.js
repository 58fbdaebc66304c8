// SPDX-License-Identifier: Apache-2.0
// Fills the page from its data. The address may say what to show: #colour=normal&shape=mesh&maps=aop&view=NAME&theme=dark.

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
  if (scan.mesh?.faces && data.mesh) tile("Mesh faces", ...short(scan.mesh.faces));
  const polarized = views.polarized ?? data.dop_full > 0;
  if (polarized && scan.options?.stereo?.polarization === false) tile("Polarization", "Not used", "(--no-polarization)");
  else tile("Polarization", polarized ? "Yes" : "No", polarized && data.dop_full ? "DoP to " + plain(data.dop_full) : "");
  const depths = data.views.filter((view) => view.depth);
  if (depths.length)
    tile("Pixels with depth", plain((100 * depths.reduce((sum, view) => sum + view.depth.share, 0)) / depths.length),
      depths.every((view) => view.depth.masked) ? "% inside the masks" : "%");
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
  for (const [name, stage] of Object.entries(scan.stages || {}))
    if (stage.state === "failed") warnings.unshift(`${STAGES[name] ?? name} failed: ${stage.error ?? ""}`);
  list("Warnings", [...new Set(warnings)].map(String), "");
  list("Not in this scan", data.notes, "plain");
}

// --- the cloud ---

function startViewer() {
  const cameras = data.views.map((view) => view.camera ?? null), empty = byId("empty");
  if (!data.cloud && !data.mesh && !cameras.some(Boolean)) {
    empty.textContent = "This scan has no cloud and no camera poses yet.";
    empty.hidden = false;
    byId("canvas").hidden = true;
    return;
  }
  try {
    viewer = new Viewer(byId("canvas"), readCloud(), readMesh(), cameras, {
      select: (index) => select(index),
      step: (by) => select((state.view + by + data.views.length) % data.views.length),
      hover: showLabel,
      turn: (axes) => {
        const canvas = document.querySelector("#legend canvas");
        if (canvas) paintBall(canvas, axes);
      },
      keys: { c: nextColour, m: () => showShape(state.shape === "mesh" ? "cloud" : "mesh") },
    });
  } catch (error) {
    empty.textContent = error.message;
    empty.hidden = false;
    return;
  }
  segments("colours", layersThere().map((layer) => [layer.key, layer.label]), showColour);
  if (data.cloud && data.mesh) segments("shapes", [["cloud", "Points"], ["mesh", "Mesh"]], showShape);
  showShape(viewer.shape);
  if (data.cloud && data.cloud.shown < data.cloud.total) {
    const outside = data.cloud.outside ? `; ${count(data.cloud.outside)} of the sample far outside are left out` : "";
    byId("help").prepend(`Shown: ${count(data.cloud.shown)} of ${count(data.cloud.total)} points${outside}. `);
  }
  if (data.mesh && data.mesh.shown < data.mesh.total)
    byId("help").prepend(`Shown: ${count(data.mesh.shown)} of the mesh's ${count(data.mesh.total)} faces. `);
}

function nextColour() {
  const keys = layersThere().map((layer) => layer.key);
  showColour(keys[(keys.indexOf(state.colour) + 1) % keys.length]);
}

function showLabel(index, x, y) {
  const label = byId("label");
  label.hidden = index < 0;
  if (index < 0) return;
  label.textContent = data.views[index].name;
  [label.style.left, label.style.top] = [x + "px", Math.max(y, 40) + "px"];
}

// --- what the address and the buttons say ---

function setTheme(theme) {
  document.documentElement.dataset.theme = theme;
  if (!viewer) return;
  viewer.frusta.dark = theme === "dark";
  viewer.draw();
}

function readAddress() {
  const wanted = new URLSearchParams(location.hash.slice(1));
  setTheme(wanted.get("theme") ?? (matchMedia("(prefers-color-scheme: dark)").matches ? "dark" : "light"));
  showColour(wanted.get("colour") ?? state.colour);
  showShape(wanted.get("shape"));
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
  byId("reset").onclick = () => viewer.goHome();
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
fillFindings();
fillEvaluation();
fillStages();
fillSettings();
document.documentElement.dataset.ready = "yes";
