// SPDX-License-Identifier: Apache-2.0
// From where the pictures were taken, where none was, and what to shoot next (report/findings.h).

const PLOT = 100, LOWEST = -30;  // radius of the plot; elevation at its rim, degrees
const SVG = "http://www.w3.org/2000/svg";

function shape(name, attributes, ...children) {
  const made = document.createElementNS(SVG, name);
  for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
  made.append(...children);
  return made;
}

// As on a map of the sky: straight up is the middle, the front is below, as seen from above.
function onPlot(azimuth_deg, elevation_deg) {
  const a = (azimuth_deg * Math.PI) / 180, r = (PLOT * (90 - Math.max(elevation_deg, LOWEST))) / (90 - LOWEST);
  return [r * Math.sin(a), r * Math.cos(a)];
}

// One cell of the grid, darker the farther the nearest camera is.
function cellOf(azimuth, elevation, step, degrees) {
  const corner = (a, e) => onPlot(a, e).map((x) => x.toFixed(2)).join(" "), top = elevation + step;
  const outline = [corner(azimuth, elevation), corner(azimuth + step / 2, elevation), corner(azimuth + step, elevation),
                   corner(azimuth + step, top), corner(azimuth + step / 2, top), corner(azimuth, top)];
  const far = clamp((degrees - 20) / 40, 0, 1);
  return shape("path", { d: `M${outline.join("L")}Z`, fill: "var(--gap)", "fill-opacity": (0.9 * far).toFixed(2) },
               shape("title", {}, `nearest camera ${degrees}° away`));
}

function coveragePlot({ step, cells, cameras }) {
  const plot = shape("svg", { viewBox: "-116 -112 232 226", class: "sky", role: "img",
                              "aria-label": "From where the pictures were taken, seen from above" });
  plot.append(shape("circle", { r: PLOT, class: "ground" }));
  cells.forEach((row, i) => row.forEach((degrees, j) => {
    if (-90 + i * step >= LOWEST) plot.append(cellOf(j * step, -90 + i * step, step, degrees));
  }));
  for (const elevation of [0, 30, 60]) {
    const r = (PLOT * (90 - elevation)) / (90 - LOWEST);
    plot.append(shape("circle", { r, class: elevation ? "ring" : "horizon" }),
                shape("text", { x: 2, y: -r - 2 }, elevation ? elevation + "°" : "horizon"));
  }
  plot.append(shape("text", { y: PLOT + 11, class: "side" }, "front"));
  cameras.forEach(({ view, azimuth, elevation }) => {
    const [x, y] = onPlot(azimuth, elevation);
    plot.append(shape("circle", { cx: x, cy: y, r: 3.2, class: "camera", "data-view": view },
                      shape("title", {}, data.views[view].name)));
  });
  plot.addEventListener("click", (event) => event.target.dataset?.view && select(Number(event.target.dataset.view)));
  return plot;
}

function showFinding(finding) {
  if (finding.layer) showColour(finding.layer);
  viewer.lookFrom(finding.from);
  byId("stage").scrollIntoView({ block: "center", behavior: "smooth" });
}

function fillFindings() {
  const { coverage, list } = data.findings ?? {};
  if (!list?.length) return byId("next").remove();
  if (coverage) byId("sky").append(coveragePlot(coverage), element("p", { class: "hint" },
      "Seen from above, straight up in the middle; dots are cameras, shaded directions have none near."));
  else byId("sky").remove();
  byId("findings").append(...list.map((finding) => {
    const parts = [element("b", {}, finding.title), element("p", {}, finding.text)];
    if (finding.from && viewer)
      parts.push(element("button", { type: "button", onclick: () => showFinding(finding) }, "Show me"));
    return element("li", { class: finding.good ? "good" : "", "data-kind": finding.kind }, ...parts);
  }));
}
