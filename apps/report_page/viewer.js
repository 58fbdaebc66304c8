// SPDX-License-Identifier: Apache-2.0
// The 3D view: a cloud of points and camera frusta in WebGL 2, turned about a target with y up.
"use strict";

const add = (a, b) => [a[0] + b[0], a[1] + b[1], a[2] + b[2]];
const sub = (a, b) => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
const scale = (a, s) => [a[0] * s, a[1] * s, a[2] * s];
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const length = (a) => Math.hypot(...a);
const unit = (a) => scale(a, 1 / (length(a) || 1));
const clamp = (x, low, high) => Math.min(high, Math.max(low, x));

const POINT_VERTEX = `#version 300 es
uniform mat4 clip_from_box;
uniform float size_px;  // at depth 1
uniform float least_px;
in vec3 place;
in vec3 colour;
out vec3 tint;
void main() {
  gl_Position = clip_from_box * vec4(place, 1.0);
  gl_PointSize = clamp(size_px / gl_Position.w, least_px, 64.0);
  tint = colour;
}`;
const POINT_FRAGMENT = `#version 300 es
precision highp float;
in vec3 tint;
out vec4 pixel;
void main() {
  vec2 d = gl_PointCoord - 0.5;
  if (dot(d, d) > 0.25) discard;
  pixel = vec4(tint, 1.0);
}`;

// Copies the points to the page and darkens pixels that lie behind their neighbours (eye-dome lighting; Boucheny,
// "Visualisation scientifique de grands volumes de donnees", 2009): edges and relief become visible without normals.
const SHADE_VERTEX = `#version 300 es
out vec2 at;
void main() {
  at = vec2(gl_VertexID & 1, gl_VertexID >> 1) * 2.0;
  gl_Position = vec4(at * 2.0 - 1.0, 0.0, 1.0);
}`;
const SHADE_FRAGMENT = `#version 300 es
precision highp float;
uniform sampler2D colours, depths;
uniform vec2 step_uv;
uniform float near, far, strength;
in vec2 at;
out vec4 pixel;
float log_depth(vec2 uv) {
  float d = texture(depths, uv).r;
  return log2(near * far / (far - d * (far - near)));
}
void main() {
  float d = texture(depths, at).r;
  gl_FragDepth = d;
  if (d >= 1.0) { pixel = vec4(0.0); return; }
  float own = log_depth(at), behind = 0.0;
  for (int i = 0; i < 8; ++i) {
    float a = float(i) * 0.7853982;
    behind += clamp(own - log_depth(at + step_uv * vec2(cos(a), sin(a))), 0.0, 0.05);
  }
  pixel = vec4(texture(colours, at).rgb * exp(-strength * behind), 1.0);
}`;

// A line of a width in pixels: four corners around a segment.
const LINE_VERTEX = `#version 300 es
uniform mat4 clip_from_world;
uniform vec2 half_size_px;
uniform float near;
in vec3 from, to;
in vec4 colour;
in float width_px;
out vec4 tint;
void main() {
  vec4 a = clip_from_world * vec4(from, 1.0), b = clip_from_world * vec4(to, 1.0);
  if (a.w < near && b.w > near) a = mix(a, b, (near - a.w) / (b.w - a.w));
  else if (b.w < near && a.w > near) b = mix(b, a, (near - b.w) / (a.w - b.w));
  vec2 along = (b.xy / b.w - a.xy / a.w) * half_size_px;
  vec2 across = vec2(-along.y, along.x) / max(length(along), 1e-6);
  gl_Position = (gl_VertexID & 1) == 0 ? a : b;
  gl_Position.xy += across * (gl_VertexID < 2 ? 0.5 : -0.5) * width_px / half_size_px * gl_Position.w;
  if (a.w < near && b.w < near) gl_Position = vec4(2.0, 2.0, 2.0, 1.0);
  tint = colour;
}`;
const LINE_FRAGMENT = `#version 300 es
precision highp float;
uniform float opacity;
in vec4 tint;
out vec4 pixel;
void main() { pixel = vec4(tint.rgb, 1.0) * tint.a * opacity; }`;

// A picture on four corners in space.
const PLATE_VERTEX = `#version 300 es
uniform mat4 clip_from_world;
uniform vec3 corners[4];
out vec2 at;
void main() {
  at = vec2(gl_VertexID & 1, gl_VertexID >> 1);
  gl_Position = clip_from_world * vec4(corners[gl_VertexID < 2 ? gl_VertexID : 5 - gl_VertexID], 1.0);
}`;
const PLATE_FRAGMENT = `#version 300 es
precision highp float;
uniform sampler2D picture;
in vec2 at;
out vec4 pixel;
void main() { pixel = texture(picture, at); }`;

function makeProgram(gl, vertex, fragment) {
  const program = gl.createProgram();
  for (const [kind, source] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
    const shader = gl.createShader(kind);
    gl.shaderSource(shader, source);
    gl.compileShader(shader);
    gl.attachShader(program, shader);
  }
  gl.linkProgram(program);
  if (!gl.getProgramParameter(program, gl.LINK_STATUS)) throw new Error("WebGL: " + gl.getProgramInfoLog(program));
  const uniforms = {};
  for (let i = 0; i < gl.getProgramParameter(program, gl.ACTIVE_UNIFORMS); ++i) {
    const name = gl.getActiveUniform(program, i).name;
    uniforms[name.replace("[0]", "")] = gl.getUniformLocation(program, name);
  }
  return { program, uniforms, attribute: (name) => gl.getAttribLocation(program, name) };
}

// The view's state: target (turned about), yaw and pitch of the eye as seen from it, distance. fov is that of the
// shorter side of the picture.
const FOV = 0.75;

class Viewer {
  // cloud: null, or {count, low, size, center, radius, spacing, positions (Uint16Array, 3 a point)}.
  // cameras: [null or {center, corners}]. on: {select(i), hover(i or -1, x, y), turn(view axes)}.
  constructor(canvas, cloud, cameras, on) {
    this.canvas = canvas;
    this.cloud = cloud;
    this.cameras = cameras;
    this.on = on;
    this.selected = this.hovered = -1;
    this.show_cameras = true;
    this.point_scale = 1;
    this.dark = false;
    const gl = (this.gl = canvas.getContext("webgl2", { antialias: true }));
    if (!gl) throw new Error("This browser gives no WebGL 2, which the 3D view needs; the rest of the page works.");
    this.measure();
    this.makeScene();
    this.goHome();
    this.listen();
    new ResizeObserver(() => this.paint()).observe(canvas);  // at once: a stretched picture is never seen
  }

  // Centre and radius of what there is to see, and how long a frustum is drawn.
  measure() {
    const places = this.cameras.filter(Boolean).map((camera) => camera.center);
    if (this.cloud) [this.center, this.radius] = [this.cloud.center, this.cloud.radius];
    else {
      this.center = scale(places.reduce(add, [0, 0, 0]), 1 / Math.max(1, places.length));
      this.radius = Math.max(1e-6, ...places.map((place) => length(sub(place, this.center))));
    }
    const distances = places.map((place) => length(sub(place, this.center))).sort((a, b) => a - b);
    const gaps = places.map((a) => Math.min(...places.filter((b) => b !== a).map((b) => length(sub(a, b)))));
    gaps.sort((a, b) => a - b);
    const typical = (distances[distances.length >> 1] || this.radius) * 0.11;
    this.frustum = Math.min(typical, (gaps[gaps.length >> 1] || typical) * 0.8) || typical;
    this.reach = Math.max(this.radius, ...distances);
  }

  makeScene() {
    const gl = this.gl;
    this.points = makeProgram(gl, POINT_VERTEX, POINT_FRAGMENT);
    this.shade = makeProgram(gl, SHADE_VERTEX, SHADE_FRAGMENT);
    this.lines = makeProgram(gl, LINE_VERTEX, LINE_FRAGMENT);
    this.plate = makeProgram(gl, PLATE_VERTEX, PLATE_FRAGMENT);
    this.nothing = gl.createVertexArray();
    this.point_array = gl.createVertexArray();
    this.line_array = gl.createVertexArray();
    [this.colour_buffer, this.line_buffer] = [gl.createBuffer(), gl.createBuffer()];
    if (this.cloud) {
      gl.bindVertexArray(this.point_array);
      gl.bindBuffer(gl.ARRAY_BUFFER, gl.createBuffer());
      gl.bufferData(gl.ARRAY_BUFFER, this.cloud.positions, gl.STATIC_DRAW);
      this.pointAt(this.points.attribute("place"), 3, gl.UNSIGNED_SHORT, true, 6, 0);
      gl.bindBuffer(gl.ARRAY_BUFFER, this.colour_buffer);
      gl.bufferData(gl.ARRAY_BUFFER, this.cloud.count * 4, gl.DYNAMIC_DRAW);
      this.pointAt(this.points.attribute("colour"), 3, gl.UNSIGNED_BYTE, true, 4, 0);
    }
    gl.bindVertexArray(this.line_array);
    gl.bindBuffer(gl.ARRAY_BUFFER, this.line_buffer);
    [["from", 3, 0], ["to", 3, 12], ["colour", 4, 24], ["width_px", 1, 40]].forEach(([name, count, offset]) => {
      this.pointAt(this.lines.attribute(name), count, gl.FLOAT, false, 44, offset);
      gl.vertexAttribDivisor(this.lines.attribute(name), 1);
    });
    this.frame = gl.createFramebuffer();
    [this.colour_texture, this.depth_texture, this.picture] = [0, 0, 0].map(() => gl.createTexture());
  }

  pointAt(attribute, count, type, normalized, stride, offset) {
    this.gl.enableVertexAttribArray(attribute);
    this.gl.vertexAttribPointer(attribute, count, type, normalized, stride, offset);
  }

  // bytes: 4 a point, red green blue and one unused.
  setColours(bytes) {
    if (!this.cloud) return;
    this.gl.bindBuffer(this.gl.ARRAY_BUFFER, this.colour_buffer);
    this.gl.bufferSubData(this.gl.ARRAY_BUFFER, 0, bytes);
    this.draw();
  }

  // image: a loaded picture of that camera (shown on its frustum), or null.
  select(index, image) {
    const gl = this.gl;
    this.selected = index;
    this.has_picture = Boolean(image);
    if (image) {
      gl.bindTexture(gl.TEXTURE_2D, this.picture);
      gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA, gl.RGBA, gl.UNSIGNED_BYTE, image);
      this.filter(gl.LINEAR);
    }
    this.draw();
  }

  filter(mode) {
    const gl = this.gl;
    for (const name of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER]) gl.texParameteri(gl.TEXTURE_2D, name, mode);
    for (const name of [gl.TEXTURE_WRAP_S, gl.TEXTURE_WRAP_T]) gl.texParameteri(gl.TEXTURE_2D, name, gl.CLAMP_TO_EDGE);
  }

  // --- where the eye is ---

  goHome(slowly) {
    const places = this.cameras.filter(Boolean).map((camera) => unit(sub(camera.center, this.center)));
    const height = places.length ? places.reduce((sum, place) => sum + place[1], 0) / places.length : 0.35;
    const home = { target: [...this.center], yaw: 0.3, pitch: clamp(Math.asin(height), 0.15, 0.8),
                   distance: (1.15 * Math.max(this.radius, Math.min(0.55 * this.reach, 1.6 * this.radius))) / Math.sin(FOV / 2) };
    if (slowly) this.fly(home);
    else Object.assign(this, home);
  }

  axes() {
    const [sy, cy, sp, cp] = [Math.sin(this.yaw), Math.cos(this.yaw), Math.sin(this.pitch), Math.cos(this.pitch)];
    return { back: [cp * sy, sp, cp * cy], right: [cy, 0, -sy], up: [-sp * sy, cp, -sp * cy] };
  }

  // The eye goes to the camera's place and looks where it looks (upright).
  lookThrough(index) {
    const camera = this.cameras[index];
    if (!camera) return;
    const forward = unit(camera.corners.reduce(add, [0, 0, 0]));
    const distance = Math.max(dot(sub(this.center, camera.center), forward), this.radius * 0.2);
    this.fly({ target: add(camera.center, scale(forward, distance)), distance,
               yaw: Math.atan2(-forward[0], -forward[2]), pitch: Math.asin(clamp(-forward[1], -1, 1)) });
  }

  // Moves there within half a second; at once for those who want no motion.
  fly(to) {
    const from = { target: this.target, yaw: this.yaw, pitch: this.pitch, distance: this.distance };
    const turn = (to.yaw ?? from.yaw) - from.yaw, round = turn - 2 * Math.PI * Math.round(turn / (2 * Math.PI));
    const end = { ...from, ...to };
    const flight = (this.flight = {});
    const start = performance.now(), still = matchMedia("(prefers-reduced-motion: reduce)").matches;
    const step = (now) => {
      if (this.flight !== flight) return;
      const t = still ? 1 : clamp((now - start) / 500, 0, 1), s = t * t * (3 - 2 * t);
      this.target = add(scale(from.target, 1 - s), scale(end.target, s));
      this.yaw = from.yaw + s * round;
      this.pitch = from.pitch + s * (end.pitch - from.pitch);
      this.distance = Math.exp(Math.log(from.distance) * (1 - s) + Math.log(end.distance) * s);
      this.paint();
      if (t < 1) requestAnimationFrame(step);
    };
    requestAnimationFrame(step);
  }

  turn(dx, dy) {
    this.yaw -= dx;
    this.pitch = clamp(this.pitch + dy, -1.55, 1.55);
    this.draw();
  }
  move(dx_px, dy_px) {
    const { right, up } = this.axes(), unit_px = this.distance / this.focal_px;
    this.target = add(this.target, add(scale(right, -dx_px * unit_px), scale(up, dy_px * unit_px)));
    this.draw();
  }
  zoom(factor) {
    this.distance = clamp(this.distance * factor, this.radius * 0.01, this.reach * 20);
    this.draw();
  }

  // Column-major clip_from_world for a canvas of width x height.
  updateMatrix(width, height) {
    const { back, right, up } = this.axes();
    this.eye = add(this.target, scale(back, this.distance));
    const gap = length(sub(this.eye, this.center)) + 8 * this.reach;
    [this.near, this.far] = [this.distance * 0.02, gap];
    const f = 1 / Math.tan(FOV / 2), short = Math.min(width, height);
    const [fx, fy] = [(f * short) / width, (f * short) / height];
    const [n, r] = [this.near, this.far], a = -(r + n) / (r - n), b = (-2 * r * n) / (r - n);
    const at = [right, up, back].map((axis) => -dot(axis, this.eye));
    const column = (x, y, z, w) => [fx * x, fy * y, a * z + b * w, -z];
    this.clip_from_world = [...[0, 1, 2].flatMap((i) => column(right[i], up[i], back[i], 0)), ...column(...at, 1)];
    this.focal_px = (f * short) / 2 / devicePixelRatio;
  }

  // Place on the canvas in CSS pixels and depth; depth <= 0: behind the eye.
  project(p) {
    const m = this.clip_from_world, w = m[3] * p[0] + m[7] * p[1] + m[11] * p[2] + m[15];
    const x = (m[0] * p[0] + m[4] * p[1] + m[8] * p[2] + m[12]) / w;
    const y = (m[1] * p[0] + m[5] * p[1] + m[9] * p[2] + m[13]) / w;
    return [((x + 1) / 2) * this.canvas.clientWidth, ((1 - y) / 2) * this.canvas.clientHeight, w];
  }

  // --- drawing ---

  draw() {
    this.flight = null;
    if (this.waiting) return;
    this.waiting = true;
    requestAnimationFrame(() => {
      this.waiting = false;
      this.paint();
    });
  }

  paint() {
    const gl = this.gl, canvas = this.canvas;
    const width = Math.round(canvas.clientWidth * devicePixelRatio);
    const height = Math.round(canvas.clientHeight * devicePixelRatio);
    if (!width || !height) return;
    if (canvas.width !== width || canvas.height !== height || !this.sized) this.resize(width, height);
    this.updateMatrix(width, height);
    gl.viewport(0, 0, width, height);
    this.paintPoints(width, height);
    if (this.show_cameras) this.paintCameras(width, height);
    this.on.turn(this.axes());
  }

  resize(width, height) {
    const gl = this.gl;
    this.sized = true;
    [this.canvas.width, this.canvas.height] = [width, height];
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.frame);
    for (const [texture, inside, format, type, part] of [
      [this.colour_texture, gl.RGBA8, gl.RGBA, gl.UNSIGNED_BYTE, gl.COLOR_ATTACHMENT0],
      [this.depth_texture, gl.DEPTH_COMPONENT24, gl.DEPTH_COMPONENT, gl.UNSIGNED_INT, gl.DEPTH_ATTACHMENT]]) {
      gl.bindTexture(gl.TEXTURE_2D, texture);
      gl.texImage2D(gl.TEXTURE_2D, 0, inside, width, height, 0, format, type, null);
      this.filter(gl.NEAREST);
      gl.framebufferTexture2D(gl.FRAMEBUFFER, part, gl.TEXTURE_2D, texture, 0);
    }
  }

  paintPoints(width, height) {
    const gl = this.gl;
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.frame);
    gl.clearColor(0, 0, 0, 0);
    gl.enable(gl.DEPTH_TEST);
    gl.depthFunc(gl.LEQUAL);
    gl.disable(gl.BLEND);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    if (this.cloud) {
      const { low, size, spacing, count } = this.cloud, m = this.clip_from_world;
      const box = [0, 1, 2].flatMap((i) => m.slice(4 * i, 4 * i + 4).map((x) => x * size[i]));
      const origin = [0, 1, 2, 3].map((i) => m[i] * low[0] + m[4 + i] * low[1] + m[8 + i] * low[2] + m[12 + i]);
      gl.useProgram(this.points.program);
      gl.uniformMatrix4fv(this.points.uniforms.clip_from_box, false, [...box, ...origin]);
      gl.uniform1f(this.points.uniforms.size_px,
                   2.2 * spacing * this.point_scale * this.focal_px * devicePixelRatio);
      gl.uniform1f(this.points.uniforms.least_px, 1.5 * devicePixelRatio * Math.min(1, this.point_scale));
      gl.bindVertexArray(this.point_array);
      gl.drawArrays(gl.POINTS, 0, count);
    }
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    gl.useProgram(this.shade.program);
    const uniforms = this.shade.uniforms;
    gl.activeTexture(gl.TEXTURE1);
    gl.bindTexture(gl.TEXTURE_2D, this.depth_texture);
    gl.activeTexture(gl.TEXTURE0);
    gl.bindTexture(gl.TEXTURE_2D, this.colour_texture);
    gl.uniform1i(uniforms.colours, 0);
    gl.uniform1i(uniforms.depths, 1);
    gl.uniform2f(uniforms.step_uv, (1.4 * devicePixelRatio) / width, (1.4 * devicePixelRatio) / height);
    gl.uniform1f(uniforms.near, this.near);
    gl.uniform1f(uniforms.far, this.far);
    gl.uniform1f(uniforms.strength, 6);
    gl.bindVertexArray(this.nothing);
    gl.drawArrays(gl.TRIANGLE_STRIP, 0, 3);
  }

  frustumCorners(camera) {
    return camera.corners.map((corner) => add(camera.center, scale(corner, this.frustum)));
  }

  // From, to, colour, width of each segment of each frustum; a tick marks the picture's upper side.
  lineData() {
    const data = [], accent = this.dark ? [0.54, 0.71, 1] : [0.14, 0.38, 0.77];
    const grey = this.dark ? [0.72, 0.76, 0.82] : [0.3, 0.34, 0.4];
    this.cameras.forEach((camera, index) => {
      if (!camera) return;
      const strong = index === this.selected || index === this.hovered;
      const fade = clamp(length(sub(this.eye, camera.center)) / this.frustum / 3 - 1, 0, 1);  // none before one's nose
      const style = strong ? [...accent, fade, 2.5 * devicePixelRatio] : [...grey, 0.75 * fade, 1.2 * devicePixelRatio];
      const c = this.frustumCorners(camera);
      const top = scale(add(c[0], c[1]), 0.5), up = scale(sub(c[0], c[3]), 0.25);
      const tip = add(top, up), near_a = add(c[0], scale(sub(c[1], c[0]), 0.35)), near_b = add(c[1], scale(sub(c[0], c[1]), 0.35));
      for (let i = 0; i < 4; ++i) data.push(...c[i], ...c[(i + 1) % 4], ...style, ...camera.center, ...c[i], ...style);
      data.push(...near_a, ...tip, ...style, ...tip, ...near_b, ...style);
    });
    return new Float32Array(data);
  }

  paintCameras(width, height) {
    const gl = this.gl, data = this.lineData();
    gl.enable(gl.BLEND);
    gl.blendFunc(gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
    this.paintPlate();
    gl.useProgram(this.lines.program);
    gl.uniformMatrix4fv(this.lines.uniforms.clip_from_world, false, this.clip_from_world);
    gl.uniform2f(this.lines.uniforms.half_size_px, width / 2, height / 2);
    gl.uniform1f(this.lines.uniforms.near, this.near);
    gl.bindVertexArray(this.line_array);
    gl.bindBuffer(gl.ARRAY_BUFFER, this.line_buffer);
    gl.bufferData(gl.ARRAY_BUFFER, data, gl.DYNAMIC_DRAW);
    gl.depthMask(false);
    for (const [test, opacity] of [[gl.LEQUAL, 1], [gl.GREATER, 0.18]]) {  // faint behind the cloud
      gl.depthFunc(test);
      gl.uniform1f(this.lines.uniforms.opacity, opacity);
      gl.drawArraysInstanced(gl.TRIANGLE_STRIP, 0, 4, data.length / 11);
    }
    gl.depthMask(true);
  }

  // The selected camera's picture on its frustum, unless the eye is near or inside.
  paintPlate() {
    const gl = this.gl, camera = this.cameras[this.selected];
    if (!camera || !this.has_picture || length(sub(this.eye, camera.center)) < 4 * this.frustum) return;
    gl.useProgram(this.plate.program);
    gl.uniformMatrix4fv(this.plate.uniforms.clip_from_world, false, this.clip_from_world);
    gl.uniform3fv(this.plate.uniforms.corners, this.frustumCorners(camera).flat());
    gl.bindTexture(gl.TEXTURE_2D, this.picture);
    gl.bindVertexArray(this.nothing);
    gl.drawArrays(gl.TRIANGLE_STRIP, 0, 4);
  }

  // --- hands ---

  // The camera whose frustum is nearest to a place on the canvas, -1 if none is near.
  cameraAt(x, y) {
    let best = -1, best_distance = 18;
    if (!this.show_cameras) return best;
    this.cameras.forEach((camera, index) => {
      if (!camera) return;
      const middle = scale(this.frustumCorners(camera).reduce(add), 0.25);
      const [a, b] = [this.project(camera.center), this.project(middle)];
      if (a[2] <= this.near || b[2] <= this.near || length(sub(this.eye, camera.center)) < 3 * this.frustum) return;
      const [dx, dy] = [b[0] - a[0], b[1] - a[1]];
      const t = clamp(((x - a[0]) * dx + (y - a[1]) * dy) / (dx * dx + dy * dy || 1), 0, 1);
      const distance = Math.hypot(a[0] + t * dx - x, a[1] + t * dy - y);
      if (distance < best_distance) [best, best_distance] = [index, distance];
    });
    return best;
  }

  // The nearest point of the cloud within a few pixels of a place on the canvas, or null.
  pointUnder(x, y) {
    if (!this.cloud) return null;
    const { low, size, positions, count } = this.cloud;
    let best = null, best_depth = Infinity;
    for (let i = 0; i < count; ++i) {
      const p = [0, 1, 2].map((k) => low[k] + (positions[3 * i + k] / 65535) * size[k]);
      const [u, v, w] = this.project(p);
      if (w > this.near && w < best_depth && Math.hypot(u - x, v - y) < 5) [best, best_depth] = [p, w];
    }
    return best;
  }

  listen() {
    const canvas = this.canvas, fingers = new Map();
    let moved = 0, hands = null;
    const place = (event) => [event.offsetX, event.offsetY];
    const gather = () => {  // middle of the fingers and their mean distance from it
      const all = [...fingers.values()], middle = scale(all.map((f) => [...f, 0]).reduce(add), 1 / all.length);
      return { count: all.length, middle, spread: all.reduce((sum, f) => sum + Math.hypot(f[0] - middle[0], f[1] - middle[1]), 0) };
    };
    const hover = (index, x, y) => {
      canvas.classList.toggle("pointing", index >= 0);
      if (index !== this.hovered) {
        this.hovered = index;
        this.draw();
      }
      this.on.hover(index, x, y);
    };
    canvas.addEventListener("pointerdown", (event) => {
      canvas.setPointerCapture(event.pointerId);
      canvas.focus({ preventScroll: true });
      if (!fingers.size) moved = 0;
      fingers.set(event.pointerId, place(event));
      hands = gather();
    });
    canvas.addEventListener("pointermove", (event) => {
      if (!fingers.has(event.pointerId)) return hover(this.cameraAt(...place(event)), ...place(event));
      fingers.set(event.pointerId, place(event));
      const now = gather(), [dx, dy] = sub(now.middle, hands.middle);
      moved += Math.abs(dx) + Math.abs(dy) + Math.abs(now.spread - hands.spread);
      if (moved > 4) {
        canvas.classList.add("turning");
        if (now.count > 1 || event.buttons & 6 || event.shiftKey) this.move(dx, dy);
        else this.turn((dx * 5) / canvas.clientHeight, (dy * 5) / canvas.clientHeight);
        if (now.count > 1 && now.spread > 0) this.zoom(hands.spread / now.spread);
      }
      hands = now;
    });
    const release = (event) => {
      if (!fingers.delete(event.pointerId)) return;
      if (fingers.size) return void (hands = gather());
      canvas.classList.remove("turning");
      const index = event.type === "pointerup" && event.button === 0 && moved <= 4 ? this.cameraAt(...place(event)) : -1;
      if (index >= 0) this.on.select(index);
    };
    canvas.addEventListener("pointerup", release);
    canvas.addEventListener("pointercancel", release);
    canvas.addEventListener("pointerleave", () => hover(-1, 0, 0));
    canvas.addEventListener("contextmenu", (event) => event.preventDefault());
    canvas.addEventListener("wheel", (event) => {
      event.preventDefault();
      const lines = event.deltaMode === 1 ? 16 : 1;
      this.zoom(Math.exp(clamp(event.deltaY * lines, -200, 200) * (event.ctrlKey ? 0.01 : 0.0015)));
    }, { passive: false });
    canvas.addEventListener("dblclick", (event) => {
      const index = this.cameraAt(...place(event));
      if (index >= 0) return this.lookThrough(index);
      const point = this.pointUnder(...place(event));
      if (point) this.fly({ target: point });
    });
    canvas.addEventListener("keydown", (event) => this.onKey(event));
  }

  onKey(event) {
    const arrows = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    const arrow = arrows[event.key], step = (by) => this.on.step(by);
    if (arrow && event.shiftKey) this.move(-40 * arrow[0], -40 * arrow[1]);
    else if (arrow) this.turn(-0.12 * arrow[0], -0.12 * arrow[1]);
    else {
      const keys = { "+": () => this.zoom(0.85), "=": () => this.zoom(0.85), "-": () => this.zoom(1 / 0.85),
                     n: () => step(1), p: () => step(-1), l: () => this.lookThrough(this.selected),
                     r: () => this.goHome(true) };
      const action = keys[event.key.toLowerCase()];
      if (!action) return;
      action();
    }
    event.preventDefault();
  }
}
