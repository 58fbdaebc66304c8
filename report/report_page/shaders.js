// SPDX-License-Identifier: Apache-2.0
// What runs on the graphics card.

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

// Lit from where the eye is, from both sides.
const MESH_VERTEX = `#version 300 es
uniform mat4 clip_from_box;
in vec3 place, normal;
in vec3 colour;
out vec3 tint, direction;
void main() {
  gl_Position = clip_from_box * vec4(place, 1.0);
  direction = normal;
  tint = colour;
}`;
const MESH_FRAGMENT = `#version 300 es
precision highp float;
uniform vec3 to_eye;
in vec3 tint, direction;
out vec4 pixel;
void main() { pixel = vec4(tint * (0.55 + 0.45 * abs(dot(normalize(direction), to_eye))), 1.0); }`;

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

// Of the texture that is bound.
function setFilter(gl, mode) {
  for (const name of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER]) gl.texParameteri(gl.TEXTURE_2D, name, mode);
  for (const name of [gl.TEXTURE_WRAP_S, gl.TEXTURE_WRAP_T]) gl.texParameteri(gl.TEXTURE_2D, name, gl.CLAMP_TO_EDGE);
}
