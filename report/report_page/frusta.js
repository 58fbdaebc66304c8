// SPDX-License-Identifier: Apache-2.0
// The cameras: a frustum each, and the picture of the selected one on its frustum.

class Frusta {
  // cameras: [null or {center, corners}]; size: length of a frustum, world units.
  constructor(gl, cameras, size) {
    [this.gl, this.cameras, this.size] = [gl, cameras, size];
    this.selected = this.hovered = -1;
    this.has_picture = this.dark = false;
    this.lines = makeProgram(gl, LINE_VERTEX, LINE_FRAGMENT);
    this.plate = makeProgram(gl, PLATE_VERTEX, PLATE_FRAGMENT);
    this.nothing = gl.createVertexArray();
    this.picture = gl.createTexture();
    this.array = gl.createVertexArray();
    gl.bindVertexArray(this.array);
    this.buffer = gl.createBuffer();
    gl.bindBuffer(gl.ARRAY_BUFFER, this.buffer);
    for (const [name, count, offset] of [["from", 3, 0], ["to", 3, 12], ["colour", 4, 24], ["width_px", 1, 40]]) {
      const attribute = this.lines.attribute(name);
      gl.enableVertexAttribArray(attribute);
      gl.vertexAttribPointer(attribute, count, gl.FLOAT, false, 44, offset);
      gl.vertexAttribDivisor(attribute, 1);
    }
  }

  // image: a loaded picture of that camera, or null.
  select(index, image) {
    const gl = this.gl;
    this.selected = index;
    this.has_picture = Boolean(image);
    if (!image) return;
    gl.bindTexture(gl.TEXTURE_2D, this.picture);
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA, gl.RGBA, gl.UNSIGNED_BYTE, image);
    setFilter(gl, gl.LINEAR);
  }

  corners(camera) {
    return camera.corners.map((corner) => add(camera.center, scale(corner, this.size)));
  }

  // From, to, colour, width of each segment of each frustum; a roof marks the picture's upper side.
  lineData(eye, ratio) {
    const data = [], accent = this.dark ? [0.54, 0.71, 1] : [0.14, 0.38, 0.77];
    const grey = this.dark ? [0.72, 0.76, 0.82] : [0.3, 0.34, 0.4];
    this.cameras.forEach((camera, index) => {
      if (!camera) return;
      const strong = index === this.selected || index === this.hovered;
      const fade = clamp(length(sub(eye.place, camera.center)) / this.size / 3 - 1, 0, 1);  // none before one's nose
      const style = strong ? [...accent, fade, 2.5 * ratio] : [...grey, 0.75 * fade, 1.2 * ratio];
      const c = this.corners(camera), between = (a, b, t) => add(a, scale(sub(b, a), t));
      const tip = add(between(c[0], c[1], 0.5), scale(sub(c[0], c[3]), 0.25));
      for (let i = 0; i < 4; ++i) data.push(...c[i], ...c[(i + 1) % 4], ...style, ...camera.center, ...c[i], ...style);
      data.push(...between(c[0], c[1], 0.35), ...tip, ...style, ...tip, ...between(c[1], c[0], 0.35), ...style);
    });
    return new Float32Array(data);
  }

  // width, height: of the canvas in device pixels, `ratio` of them in a CSS pixel.
  paint(eye, width, height, ratio) {
    const gl = this.gl, data = this.lineData(eye, ratio), uniforms = this.lines.uniforms;
    gl.enable(gl.BLEND);
    gl.blendFunc(gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
    this.paintPlate(eye);
    gl.useProgram(this.lines.program);
    gl.uniformMatrix4fv(uniforms.clip_from_world, false, eye.clip_from_world);
    gl.uniform2f(uniforms.half_size_px, width / 2, height / 2);
    gl.uniform1f(uniforms.near, eye.near);
    gl.bindVertexArray(this.array);
    gl.bindBuffer(gl.ARRAY_BUFFER, this.buffer);
    gl.bufferData(gl.ARRAY_BUFFER, data, gl.DYNAMIC_DRAW);
    gl.depthMask(false);
    for (const [test, opacity] of [[gl.LEQUAL, 1], [gl.GREATER, 0.18]]) {  // faint behind the object
      gl.depthFunc(test);
      gl.uniform1f(uniforms.opacity, opacity);
      gl.drawArraysInstanced(gl.TRIANGLE_STRIP, 0, 4, data.length / 11);
    }
    gl.depthMask(true);
  }

  // The selected camera's picture on its frustum, unless the eye is near or inside.
  paintPlate(eye) {
    const gl = this.gl, camera = this.cameras[this.selected];
    if (!camera || !this.has_picture || length(sub(eye.place, camera.center)) < 4 * this.size) return;
    gl.useProgram(this.plate.program);
    gl.uniformMatrix4fv(this.plate.uniforms.clip_from_world, false, eye.clip_from_world);
    gl.uniform3fv(this.plate.uniforms.corners, this.corners(camera).flat());
    gl.bindTexture(gl.TEXTURE_2D, this.picture);
    gl.bindVertexArray(this.nothing);
    gl.drawArrays(gl.TRIANGLE_STRIP, 0, 4);
  }

  // The camera whose frustum is nearest to a place on the canvas (CSS pixels), -1 if none is near.
  at(eye, x, y) {
    let best = -1, best_distance = 18;
    this.cameras.forEach((camera, index) => {
      if (!camera || length(sub(eye.place, camera.center)) < 3 * this.size) return;
      const [a, b] = [camera.center, scale(this.corners(camera).reduce(add), 0.25)].map((p) => eye.project(p));
      if (a[2] <= eye.near || b[2] <= eye.near) return;
      const [dx, dy] = [b[0] - a[0], b[1] - a[1]];
      const t = clamp(((x - a[0]) * dx + (y - a[1]) * dy) / (dx * dx + dy * dy || 1), 0, 1);
      const distance = Math.hypot(a[0] + t * dx - x, a[1] + t * dy - y);
      if (distance < best_distance) [best, best_distance] = [index, distance];
    });
    return best;
  }
}
