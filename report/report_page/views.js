// SPDX-License-Identifier: Apache-2.0
// The selected view with its pictures, and the gallery of all views.

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
    facts.push(["Depth", `${plain(view.depth.near)} to ${plain(view.depth.far)} (${data.scan?.unit === "mm" ? "mm" : "arbitrary units"})`]);
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
  const limits = data.evaluation?.pictures;
  if (limits && key === "depth_error") return [ramp("heat", "0", `${plain(limits.depth)} and more`), words("Depth against the truth; blue: missing.")];
  if (limits && key === "normal_error") return [ramp("heat", "0", `${plain(limits.normal)}° and more`), words("Normals against the truth; blue: missing.")];
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
