// SPDX-License-Identifier: Apache-2.0
// Where one looks from: a target that is turned about, yaw and pitch of the eye as seen from it, and the distance.
// y is up. fov is that of the shorter side of the picture.

const FOV = 0.75;

class Eye {
  // scene: {center, radius, reach}: what there is to see, its size, and how far the cameras reach.
  constructor(scene, home) {
    this.scene = scene;
    this.home = home;
    this.width = this.height = 1;  // of the canvas, CSS pixels
    Object.assign(this, home);
  }

  // The same eye wherever the cameras stand: at their mean height, so far away that everything is in the picture.
  static home(scene, camera_places) {
    const heights = camera_places.map((place) => unit(sub(place, scene.center))[1]);
    const height = heights.length ? heights.reduce((sum, y) => sum + y, 0) / heights.length : 0.35;
    const size = Math.max(scene.radius, Math.min(0.55 * scene.reach, 1.6 * scene.radius));
    return { target: [...scene.center], yaw: 0.3, pitch: clamp(Math.asin(height), 0.15, 0.8),
             distance: (1.15 * size) / Math.sin(FOV / 2) };
  }

  axes() {
    const [sy, cy, sp, cp] = [Math.sin(this.yaw), Math.cos(this.yaw), Math.sin(this.pitch), Math.cos(this.pitch)];
    return { back: [cp * sy, sp, cp * cy], right: [cy, 0, -sy], up: [-sp * sy, cp, -sp * cy] };
  }

  turn(dx, dy) {
    this.yaw -= dx;
    this.pitch = clamp(this.pitch + dy, -1.55, 1.55);
  }
  move(dx_px, dy_px) {
    const { right, up } = this.axes(), unit_px = this.distance / this.focal_px;
    this.target = add(this.target, add(scale(right, -dx_px * unit_px), scale(up, dy_px * unit_px)));
  }
  zoom(factor) {
    this.distance = clamp(this.distance * factor, this.scene.radius * 0.01, this.scene.reach * 20);
  }

  // Yaw and pitch of an eye that stands in this direction from the target.
  static towards(direction) {
    const d = unit(direction);
    return { yaw: Math.atan2(d[0], d[2]), pitch: clamp(Math.asin(clamp(d[1], -1, 1)), -1.55, 1.55) };
  }

  // The eye at the camera's place, looking where it looks (upright).
  through(camera) {
    const forward = unit(camera.corners.reduce(add, [0, 0, 0]));
    const distance = Math.max(dot(sub(this.scene.center, camera.center), forward), this.scene.radius * 0.2);
    return { target: add(camera.center, scale(forward, distance)), distance, ...Eye.towards(scale(forward, -1)) };
  }

  state() {
    return { target: this.target, yaw: this.yaw, pitch: this.pitch, distance: this.distance };
  }

  // On the way from one state to another, 0 <= t <= 1; the short way round, zooming evenly.
  between(from, to, t) {
    const s = t * t * (3 - 2 * t), turn = to.yaw - from.yaw;
    this.target = add(scale(from.target, 1 - s), scale(to.target, s));
    this.yaw = from.yaw + s * (turn - 2 * Math.PI * Math.round(turn / (2 * Math.PI)));
    this.pitch = from.pitch + s * (to.pitch - from.pitch);
    this.distance = Math.exp(Math.log(from.distance) * (1 - s) + Math.log(to.distance) * s);
  }

  // Brings place, near, far, focal_px and clip_from_world (column-major) up to date for a canvas of this size in CSS pixels.
  update(width, height) {
    [this.width, this.height] = [width, height];
    const { back, right, up } = this.axes();
    this.place = add(this.target, scale(back, this.distance));
    this.near = this.distance * 0.02;
    this.far = length(sub(this.place, this.scene.center)) + 8 * this.scene.reach;
    const f = 1 / Math.tan(FOV / 2), short = Math.min(width, height);
    const [fx, fy] = [(f * short) / width, (f * short) / height];
    const [n, r] = [this.near, this.far], a = -(r + n) / (r - n), b = (-2 * r * n) / (r - n);
    const at = [right, up, back].map((axis) => -dot(axis, this.place));
    const column = (x, y, z, w) => [fx * x, fy * y, a * z + b * w, -z];
    this.clip_from_world = [...[0, 1, 2].flatMap((i) => column(right[i], up[i], back[i], 0)), ...column(...at, 1)];
    this.focal_px = (f * short) / 2;
  }

  // clip_from_world of places counted from `low` in units of `size`.
  clipFromBox(low, size) {
    const m = this.clip_from_world;
    return [...[0, 1, 2].flatMap((i) => m.slice(4 * i, 4 * i + 4).map((x) => x * size[i])),
            ...[0, 1, 2, 3].map((i) => m[i] * low[0] + m[4 + i] * low[1] + m[8 + i] * low[2] + m[12 + i])];
  }

  // Place on the canvas in CSS pixels and depth; depth <= 0: behind the eye.
  project(p) {
    const m = this.clip_from_world, w = m[3] * p[0] + m[7] * p[1] + m[11] * p[2] + m[15];
    const x = (m[0] * p[0] + m[4] * p[1] + m[8] * p[2] + m[12]) / w;
    const y = (m[1] * p[0] + m[5] * p[1] + m[9] * p[2] + m[13]) / w;
    return [((x + 1) / 2) * this.width, ((1 - y) / 2) * this.height, w];
  }
}
