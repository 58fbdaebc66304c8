// SPDX-License-Identifier: Apache-2.0
// What is drawn of the object: a cloud of points, or a mesh. Both are {count, low, size, positions (Uint16Array, 3 a
// point)}; a mesh has normals (Int8Array, 3 a point) and indices (Uint32Array, 3 a triangle) as well.

class PointLayer {
  constructor(gl, cloud) {
    [this.gl, this.cloud] = [gl, cloud];
    this.shader = makeProgram(gl, POINT_VERTEX, POINT_FRAGMENT);
    this.array = gl.createVertexArray();
    gl.bindVertexArray(this.array);
    addPositions(gl, this.shader, cloud);
    this.colours = addColours(gl, this.shader, cloud.count);
  }

  // scale: of the points' size; ratio: device pixels in a CSS pixel.
  paint(eye, scale, ratio) {
    const gl = this.gl, { low, size, spacing, count } = this.cloud, uniforms = this.shader.uniforms;
    gl.useProgram(this.shader.program);
    gl.uniformMatrix4fv(uniforms.clip_from_box, false, eye.clipFromBox(low, size));
    gl.uniform1f(uniforms.size_px, 2.2 * spacing * scale * eye.focal_px * ratio);
    gl.uniform1f(uniforms.least_px, 1.5 * ratio * Math.min(1, scale));
    gl.bindVertexArray(this.array);
    gl.drawArrays(gl.POINTS, 0, count);
  }
}

class MeshLayer {
  constructor(gl, mesh) {
    [this.gl, this.cloud] = [gl, mesh];
    this.shader = makeProgram(gl, MESH_VERTEX, MESH_FRAGMENT);
    this.array = gl.createVertexArray();
    gl.bindVertexArray(this.array);
    addPositions(gl, this.shader, mesh);
    addBuffer(gl, mesh.normals);
    pointAt(gl, this.shader.attribute("normal"), 3, gl.BYTE, 3);
    this.colours = addColours(gl, this.shader, mesh.count);
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, gl.createBuffer());
    gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, mesh.indices, gl.STATIC_DRAW);
    gl.bindVertexArray(null);
  }

  paint(eye) {
    const gl = this.gl, { low, size, indices } = this.cloud, uniforms = this.shader.uniforms;
    gl.useProgram(this.shader.program);
    gl.uniformMatrix4fv(uniforms.clip_from_box, false, eye.clipFromBox(low, size));
    gl.uniform3fv(uniforms.to_eye, eye.axes().back);
    gl.bindVertexArray(this.array);
    gl.drawElements(gl.TRIANGLES, indices.length, gl.UNSIGNED_INT, 0);
  }
}

function addBuffer(gl, content) {
  const buffer = gl.createBuffer();
  gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
  gl.bufferData(gl.ARRAY_BUFFER, content, gl.STATIC_DRAW);
  return buffer;
}

function pointAt(gl, attribute, count, type, stride) {
  gl.enableVertexAttribArray(attribute);
  gl.vertexAttribPointer(attribute, count, type, true, stride, 0);
}

function addPositions(gl, shader, cloud) {
  addBuffer(gl, cloud.positions);
  pointAt(gl, shader.attribute("place"), 3, gl.UNSIGNED_SHORT, 6);
}

function addColours(gl, shader, count) {
  const buffer = addBuffer(gl, new Uint8Array(4 * count));
  pointAt(gl, shader.attribute("colour"), 3, gl.UNSIGNED_BYTE, 4);
  return buffer;
}
