// SPDX-License-Identifier: Apache-2.0
// The cloud and the mesh as the page holds them, and their layers as colours.

const PALETTES = { dop: "heat", error: "heat" };  // the others: ramp
const paletteOf = (key) => PALETTES[key] ?? "ramp";

// Cuts the bytes after `offset` into one part a layer (report/scene/cloud.h).
function cutLayers(surface, bytes, offset) {
  for (const layer of surface.layers) {
    const size = surface.count * (layer.key === "colour" || layer.key === "normal" ? 3 : 1);
    surface.parts[layer.key] = bytes.subarray(offset, (offset += size));
  }
  return surface;
}

function readCloud() {
  if (!data.cloud) return null;
  const bytes = bytesOf(byId("cloud").textContent), cloud = { ...data.cloud, count: data.cloud.shown, parts: {} };
  cloud.positions = new Uint16Array(bytes.buffer, 0, 3 * cloud.count);
  return cutLayers(cloud, bytes, 6 * cloud.count);
}

// report/scene/mesh.h: the triangles first.
function readMesh() {
  if (!data.mesh) return null;
  const bytes = bytesOf(byId("mesh").textContent), mesh = { ...data.mesh, count: data.mesh.vertices, parts: {} };
  const indices = 3 * mesh.shown, start = 4 * indices;
  mesh.indices = new Uint32Array(bytes.buffer, 0, indices);
  mesh.positions = new Uint16Array(bytes.buffer, start, 3 * mesh.count);
  cutLayers(mesh, bytes, start + 6 * mesh.count);
  const normal = mesh.parts.normal;
  mesh.normals = new Int8Array(normal.buffer, normal.byteOffset, normal.length);
  return mesh;
}

// Four bytes a point. A layer that this surface does not have is grey.
function coloursOf(surface, key) {
  const colours = new Uint8Array(4 * surface.count).fill(176), part = surface.parts[key];
  if (!part) return colours;
  const normals = key === "normal" && new Int8Array(part.buffer, part.byteOffset, part.length);
  const palette = palettes[paletteOf(key)];
  for (let i = 0; i < surface.count; ++i)
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

function showLegend(layer) {
  const legend = byId("legend");
  if (layer.key === "colour") return legend.replaceChildren();
  if (layer.key === "normal") {
    const canvas = element("canvas", { width: 96, height: 96 });
    legend.replaceChildren(element("span", { class: "dial", role: "img",
        "aria-label": "A ball coloured like the normals, as seen from here" }, canvas));
    return paintBall(canvas, viewer.eye.axes());
  }
  const low = layer.low === 0 ? "0" : plain(layer.low), high = plain(layer.high) + (layer.open ? " and more" : "");
  legend.replaceChildren(layer.label + (layer.unit ? ` (${layer.unit}) ` : " "), ramp(paletteOf(layer.key), low, high));
}

// The layers of what is there: the cloud's, or the mesh's where there is no cloud.
const layersThere = () => (data.cloud ?? data.mesh)?.layers ?? [];

function showColour(key) {
  const layer = layersThere().find((each) => each.key === key) ?? layersThere()[0];
  if (!layer || !viewer) return;
  state.colour = layer.key;
  for (const [shape, each] of Object.entries(viewer.layers))
    if (each) viewer.setColours(shape, coloursOf(each.cloud, layer.key));
  showLegend(layer);
  press("colours", layer.key);
}

function showShape(shape) {
  if (!viewer?.layers[shape]) return;
  state.shape = shape;
  viewer.setShape(shape);
  press("shapes", shape);
}
