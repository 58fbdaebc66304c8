// SPDX-License-Identifier: Apache-2.0
// Stages and settings.

const byStage = (a, b) => Object.keys(STAGES).indexOf(a[0]) - Object.keys(STAGES).indexOf(b[0]);

// What is shown of what a stage counted, for one and for more; the rest is for programs that read scan.json.
const COUNTS = { points: ["point", "points"], registered: ["view placed", "views placed"], views: ["view", "views"],
                 vertices: ["vertex", "vertices"], faces: ["triangle", "triangles"],
                 damaged: ["view left out, its maps are damaged", "views left out, their maps are damaged"],
                 holes_filled: ["hole filled", "holes filled"], holes_open: ["hole left open", "holes left open"],
                 pieces_dropped: ["small piece left out", "small pieces left out"] };
const EVEN_ZERO = ["points", "registered", "views", "vertices", "faces"];
const MEANS = { mean_views: "views a point", mean_confidence: "mean confidence" };

// "3,059 points · 10 views · mean confidence 0.47".
function countsOf(stage) {
  const counts = stage.counts || {}, is = (key) => typeof counts[key] === "number";
  const there = Object.keys(COUNTS).filter((key) => is(key) && (counts[key] || EVEN_ZERO.includes(key)));
  return [...there.map((key) => `${count(counts[key])} ${COUNTS[key][counts[key] === 1 ? 0 : 1]}`),
          ...Object.keys(MEANS).filter(is).map((key) => `${MEANS[key]} ${plain(counts[key])}`)].join(" · ");
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
