// SPDX-License-Identifier: Apache-2.0
// The 3D view in WebGL 2: the cloud or the mesh, shaded by its depths, and the cameras.

class Viewer {
  // cloud, mesh: null or as in surface.js, with center, radius and spacing. cameras: [null or {center, corners}].
  // on: {select(i), step(by), hover(i or -1, x, y), turn(view axes)}.
  constructor(canvas, cloud, mesh, cameras, on) {
    [this.canvas, this.cloud, this.on] = [canvas, cloud, on];
    this.show_cameras = true;
    this.point_scale = 1;
    const gl = (this.gl = canvas.getContext("webgl2", { antialias: true }));
    if (!gl) throw new Error("This browser gives no WebGL 2, which the 3D view needs; the rest of the page works.");
    const places = cameras.filter(Boolean).map((camera) => camera.center), scene = Viewer.measure(cloud ?? mesh, places);
    this.eye = new Eye(scene, Eye.home(scene, places));
    this.frusta = new Frusta(gl, cameras, scene.frustum);
    this.shade = makeProgram(gl, SHADE_VERTEX, SHADE_FRAGMENT);
    this.nothing = gl.createVertexArray();
    this.frame = gl.createFramebuffer();
    [this.colour_texture, this.depth_texture] = [0, 0].map(() => gl.createTexture());
    this.layers = { cloud: cloud && new PointLayer(gl, cloud), mesh: mesh && new MeshLayer(gl, mesh) };
    this.shape = cloud ? "cloud" : "mesh";
    listenToHands(this);
    new ResizeObserver(() => this.paint()).observe(canvas);  // at once: a stretched picture is never seen
  }

  // Centre and radius of what there is to see, how far the cameras reach, and how long a frustum is drawn.
  static measure(surface, places) {
    const middle = () => scale(places.reduce(add, [0, 0, 0]), 1 / Math.max(1, places.length));
    const center = surface?.center ?? middle();
    const distances = places.map((place) => length(sub(place, center))).sort((a, b) => a - b);
    const radius = surface?.radius ?? Math.max(1e-6, ...distances);
    const gaps = places.map((a) => Math.min(...places.filter((b) => b !== a).map((b) => length(sub(a, b)))));
    gaps.sort((a, b) => a - b);
    const typical = (distances[distances.length >> 1] || radius) * 0.11;
    const frustum = Math.min(typical, (gaps[gaps.length >> 1] || typical) * 0.8) || typical;
    return { center, radius, frustum, reach: Math.max(radius, ...distances) };
  }

  // bytes: 4 a point, red green blue and one unused.
  setColours(shape, bytes) {
    const layer = this.layers[shape];
    if (!layer) return;
    this.gl.bindBuffer(this.gl.ARRAY_BUFFER, layer.colours);
    this.gl.bufferSubData(this.gl.ARRAY_BUFFER, 0, bytes);
    this.draw();
  }
  setShape(shape) {
    this.shape = shape;
    this.draw();
  }
  select(index, image) {
    this.frusta.select(index, image);
    this.draw();
  }

  // --- the eye ---

  turn(dx, dy) {
    this.flight = null;  // the hand rules
    this.eye.turn(dx, dy);
    this.draw();
  }
  move(dx_px, dy_px) {
    this.flight = null;
    this.eye.move(dx_px, dy_px);
    this.draw();
  }
  zoom(factor) {
    this.flight = null;
    this.eye.zoom(factor);
    this.draw();
  }
  goHome() {
    this.fly(this.eye.home);
  }
  lookFrom(direction) {
    this.fly({ ...this.eye.home, ...Eye.towards(direction) });
  }
  lookThrough(index) {
    const camera = this.frusta.cameras[index];
    if (camera) this.fly(this.eye.through(camera));
  }

  // Moves there within half a second; at once for those who want no motion.
  fly(to) {
    const from = this.eye.state(), end = { ...from, ...to }, flight = (this.flight = {});
    const start = performance.now(), still = matchMedia("(prefers-reduced-motion: reduce)").matches;
    const step = (now) => {
      if (this.flight !== flight) return;
      const t = still ? 1 : clamp((now - start) / 500, 0, 1);
      this.eye.between(from, end, t);
      this.paint();
      if (t < 1) requestAnimationFrame(step);
    };
    requestAnimationFrame(step);
  }

  // --- drawing ---

  draw() {
    if (this.waiting) return;
    this.waiting = true;
    requestAnimationFrame(() => {
      this.waiting = false;
      this.paint();
    });
  }

  paint() {
    const gl = this.gl, canvas = this.canvas, ratio = devicePixelRatio;
    const width = Math.round(canvas.clientWidth * ratio), height = Math.round(canvas.clientHeight * ratio);
    if (!width || !height) return;
    if (canvas.width !== width || canvas.height !== height || !this.sized) this.resize(width, height);
    this.eye.update(canvas.clientWidth, canvas.clientHeight);
    gl.viewport(0, 0, width, height);
    this.paintSurface(ratio);
    this.paintShaded(width, height, ratio);
    if (this.show_cameras) this.frusta.paint(this.eye, width, height, ratio);
    this.on.turn(this.eye.axes());
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
      setFilter(gl, gl.NEAREST);
      gl.framebufferTexture2D(gl.FRAMEBUFFER, part, gl.TEXTURE_2D, texture, 0);
    }
  }

  // Into this.frame: colours and depths.
  paintSurface(ratio) {
    const gl = this.gl;
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.frame);
    gl.clearColor(0, 0, 0, 0);
    gl.enable(gl.DEPTH_TEST);
    gl.depthFunc(gl.LEQUAL);
    gl.disable(gl.BLEND);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    this.layers[this.shape]?.paint(this.eye, this.point_scale, ratio);
  }

  // From this.frame to the page.
  paintShaded(width, height, ratio) {
    const gl = this.gl, uniforms = this.shade.uniforms;
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    gl.useProgram(this.shade.program);
    gl.activeTexture(gl.TEXTURE1);
    gl.bindTexture(gl.TEXTURE_2D, this.depth_texture);
    gl.activeTexture(gl.TEXTURE0);
    gl.bindTexture(gl.TEXTURE_2D, this.colour_texture);
    gl.uniform1i(uniforms.colours, 0);
    gl.uniform1i(uniforms.depths, 1);
    gl.uniform2f(uniforms.step_uv, (1.4 * ratio) / width, (1.4 * ratio) / height);
    gl.uniform1f(uniforms.near, this.eye.near);
    gl.uniform1f(uniforms.far, this.eye.far);
    gl.uniform1f(uniforms.strength, this.shape === "mesh" ? 2 : 6);
    gl.bindVertexArray(this.nothing);
    gl.drawArrays(gl.TRIANGLE_STRIP, 0, 3);
  }

  // --- what lies where ---

  cameraAt(x, y) {
    return this.show_cameras ? this.frusta.at(this.eye, x, y) : -1;
  }

  // The nearest point of what is shown within a few pixels of a place on the canvas, or null.
  pointUnder(x, y) {
    const surface = this.layers[this.shape]?.cloud;
    if (!surface) return null;
    const { low, size, positions, count } = surface;
    let best = null, best_depth = Infinity;
    for (let i = 0; i < count; ++i) {
      const p = [0, 1, 2].map((k) => low[k] + (positions[3 * i + k] / 65535) * size[k]);
      const [u, v, w] = this.eye.project(p);
      if (w > this.eye.near && w < best_depth && Math.hypot(u - x, v - y) < 5) [best, best_depth] = [p, w];
    }
    return best;
  }
}
