// SPDX-License-Identifier: Apache-2.0
// What `polarscan evaluate` left in the scan: figures against the truth, and their curves.

const percent = (share) => (share === undefined || share === null ? "" : plain(100 * share) + " %");

function table(head, rows) {
  return element("table", { class: "figures" },
    element("thead", {}, element("tr", {}, ...head.map((text) => element("th", { scope: "col" }, text)))),
    element("tbody", {}, ...rows.map(([name, ...values]) => element("tr", {}, element("th", { scope: "row" }, name),
      ...values.map((value) => element("td", {}, value))))));
}

function cloudTable(cloud) {
  const size = (part) => (part ? [plain(part.mean), plain(part.median), plain(part.p90)] : ["", "", ""]);
  const sorted = Object.entries(cloud.thresholds).sort((a, b) => a[0] - b[0]);
  return [table(["Cloud", "mean", "median", "90 %"], [["Accuracy", ...size(cloud.accuracy)], ["Completeness", ...size(cloud.completeness)]]),
          table(["Within", "precision", "recall", "F"],
                sorted.map(([limit, each]) => [limit, percent(each.precision), percent(each.recall), percent(each.F)]))];
}

function mapsTable(maps) {
  const row = (name, errors) => errors && [name, plain(errors.over_all.mean), plain(errors.over_all.median)];
  return [table(["Maps, all pixels", "mean", "median"],
                [row("Depth", maps.mean.depth), row("Normal (degrees)", maps.mean.normal_degrees)].filter(Boolean))];
}

// Our own drawings (evaluation/plots.h): parsed as pictures, so that no text in them can become markup.
function drawing(svg) {
  return document.importNode(new DOMParser().parseFromString(svg, "image/svg+xml").documentElement, true);
}

function fillEvaluation() {
  const evaluation = data.evaluation;
  if (!evaluation) return byId("evaluation").remove();
  byId("figures").append(...(evaluation.cloud ? cloudTable(evaluation.cloud) : []), ...(evaluation.maps ? mapsTable(evaluation.maps) : []),
                         element("p", { class: "hint" }, `Lengths in the truth's units. Truth: ${evaluation.truth}`));
  byId("curves").append(...data.curves.map(drawing));
}
