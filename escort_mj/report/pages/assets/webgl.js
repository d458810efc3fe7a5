// Solid bodies and lines of any width in WebGL 2, and a camera to be dragged.
"use strict";

const SOLID_VERTEX = `#version 300 es
layout(location=0) in vec3 vertex; layout(location=1) in vec3 normal;
layout(location=2) in vec3 place; layout(location=3) in vec4 turn;
layout(location=4) in vec3 scale; layout(location=5) in vec4 color;
uniform mat4 view; out vec3 n; out vec4 c;
vec3 turned(vec3 v) { return v + 2.0 * cross(turn.yzw, cross(turn.yzw, v) + turn.x * v); }
void main() {
  gl_Position = view * vec4(turned(vertex * scale) + place, 1.0);
  n = turned(normal / scale); c = color;
}`;
const SOLID_FRAGMENT = `#version 300 es
precision highp float; in vec3 n; in vec4 c; uniform vec3 sun; uniform float flat_light; out vec4 pixel;
void main() {
  float light = 0.62 + 0.38 * dot(normalize(n), sun);
  pixel = vec4(c.rgb * mix(light, 1.0, flat_light), c.a);
}`;
const LINE_VERTEX = `#version 300 es
layout(location=0) in vec3 from; layout(location=1) in vec3 to; layout(location=2) in vec4 color;
layout(location=3) in float width;
uniform mat4 view; uniform vec2 size; out vec4 c;
void main() {
  vec4 a = view * vec4(from, 1.0), b = view * vec4(to, 1.0);
  float near = 0.01;  // a line that begins behind the eye is cut there
  if (a.w < near) a = mix(b, a, (b.w - near) / (b.w - a.w));
  if (b.w < near) b = mix(a, b, (a.w - near) / (a.w - b.w));
  vec2 along = (b.xy / b.w - a.xy / a.w) * size;
  along = length(along) > 0.0 ? normalize(along) : vec2(1.0, 0.0);
  bool second = gl_VertexID > 1; float side = gl_VertexID % 2 == 0 ? -1.0 : 1.0;
  vec4 end = second ? b : a;
  end.xy += side * vec2(-along.y, along.x) * width / size * end.w;
  gl_Position = end; c = color;
}`;
const LINE_FRAGMENT = `#version 300 es
precision highp float; in vec4 c; out vec4 pixel; void main() { pixel = c; }`;

function program(gl, vertex, fragment) {
  const made = gl.createProgram();
  for (const [kind, text] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
    const shader = gl.createShader(kind);
    gl.shaderSource(shader, text);
    gl.compileShader(shader);
    gl.attachShader(made, shader);
  }
  gl.linkProgram(made);
  if (!gl.getProgramParameter(made, gl.LINK_STATUS)) throw new Error(gl.getProgramInfoLog(made));
  return made;
}

function normals(vertices, faces) {  // of corners, weighted by the areas around them
  const found = new Float32Array(vertices.length);
  for (let f = 0; f < faces.length; f += 3) {
    const [a, b, c] = [0, 1, 2].map(k => vertices.subarray(3 * faces[f + k], 3 * faces[f + k] + 3));
    const u = [0, 1, 2].map(k => b[k] - a[k]), v = [0, 1, 2].map(k => c[k] - a[k]);
    const n = cross(u, v);
    for (let corner = 0; corner < 3; corner++)
      for (let k = 0; k < 3; k++) found[3 * faces[f + corner] + k] += n[k];
  }
  return found;
}

class Canvas {
  constructor(gl, meshes) {
    this.gl = gl;
    this.solid = program(gl, SOLID_VERTEX, SOLID_FRAGMENT);
    this.line = program(gl, LINE_VERTEX, LINE_FRAGMENT);
    this.instances = gl.createBuffer();
    this.segments = gl.createBuffer();
    this.meshes = meshes.map(mesh => this.mesh(mesh));
    this.lines = gl.createVertexArray();
    gl.bindVertexArray(this.lines);
    this.attributes(this.segments, [[0, 3], [1, 3], [2, 4], [3, 1]], 1);
    gl.enable(gl.DEPTH_TEST);
    gl.blendFuncSeparate(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA, gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
  }

  attributes(buffer, fields, divisor) {
    const gl = this.gl, stride = 4 * fields.reduce((sum, [, size]) => sum + size, 0);
    gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
    let offset = 0;
    for (const [location, size] of fields) {
      gl.enableVertexAttribArray(location);
      gl.vertexAttribPointer(location, size, gl.FLOAT, false, stride, offset);
      gl.vertexAttribDivisor(location, divisor);
      offset += 4 * size;
    }
  }

  mesh({ vertices, faces }) {
    const gl = this.gl, corners = unpack(vertices, Float32Array), indices = unpack(faces, Uint16Array);
    const array = gl.createVertexArray();
    gl.bindVertexArray(array);
    for (const [location, values] of [[0, corners], [1, normals(corners, indices)]]) {
      const buffer = gl.createBuffer();
      gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
      gl.bufferData(gl.ARRAY_BUFFER, values, gl.STATIC_DRAW);
      this.attributes(buffer, [[location, 3]], 0);
    }
    this.attributes(this.instances, [[2, 3], [3, 4], [4, 3], [5, 4]], 1);
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, gl.createBuffer());
    gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, indices, gl.STATIC_DRAW);
    return { array, count: indices.length };
  }

  begin(width, height, camera) {
    const gl = this.gl;
    this.view = camera.matrix(width / height);
    this.size = [width, height];
    this.sun = camera.sun();
    gl.viewport(0, 0, width, height);
    gl.clearColor(0.945, 0.957, 0.972, 1);
    gl.disable(gl.BLEND);
    gl.depthMask(true);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
  }

  solids(mesh, numbers, { flat = 0, seethrough = false } = {}) {  // 14 numbers each
    if (!numbers.length) return;
    const gl = this.gl, { array, count } = this.meshes[mesh];
    this.blend(seethrough);
    gl.useProgram(this.solid);
    gl.uniformMatrix4fv(gl.getUniformLocation(this.solid, "view"), false, this.view);
    gl.uniform3fv(gl.getUniformLocation(this.solid, "sun"), this.sun);
    gl.uniform1f(gl.getUniformLocation(this.solid, "flat_light"), flat);
    gl.bindVertexArray(array);
    gl.bindBuffer(gl.ARRAY_BUFFER, this.instances);
    gl.bufferData(gl.ARRAY_BUFFER, new Float32Array(numbers), gl.DYNAMIC_DRAW);
    gl.drawElementsInstanced(gl.TRIANGLES, count, gl.UNSIGNED_SHORT, 0, numbers.length / 14);
  }

  path(numbers) {  // 11 numbers a segment
    if (!numbers.length) return;
    const gl = this.gl;
    this.blend(true);
    gl.useProgram(this.line);
    gl.uniformMatrix4fv(gl.getUniformLocation(this.line, "view"), false, this.view);
    gl.uniform2fv(gl.getUniformLocation(this.line, "size"), this.size);
    gl.bindVertexArray(this.lines);
    gl.bindBuffer(gl.ARRAY_BUFFER, this.segments);
    gl.bufferData(gl.ARRAY_BUFFER, new Float32Array(numbers), gl.DYNAMIC_DRAW);
    gl.drawArraysInstanced(gl.TRIANGLE_STRIP, 0, 4, numbers.length / 11);
  }

  blend(seethrough) {
    const gl = this.gl;
    if (seethrough) gl.enable(gl.BLEND); else gl.disable(gl.BLEND);
    gl.depthMask(!seethrough);
  }
}


const cross = (a, b) => [
  a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0],
];
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];

class Camera {
  constructor([x, y, z, distance, azimuth, elevation], fieldOfView) {
    Object.assign(this, { at: [x, y, z], distance, azimuth, elevation, fieldOfView });
    this.first = { at: [x, y, z], distance, azimuth, elevation };
  }

  reset() { Object.assign(this, { ...this.first, at: [...this.first.at] }); }

  axes() {
    const [a, e] = [this.azimuth, this.elevation];
    const forward = [Math.cos(e) * Math.cos(a), Math.cos(e) * Math.sin(a), Math.sin(e)];
    const right = [Math.sin(a), -Math.cos(a), 0];
    return { right, up: cross(right, forward), forward };
  }

  sun() {
    const { right, up, forward } = this.axes();
    const sum = [0, 1, 2].map(k => 0.35 * up[k] - 0.25 * right[k] - 0.35 * forward[k] + (k === 2 ? 1 : 0));
    const length = Math.hypot(...sum);
    return sum.map(x => x / length);
  }

  matrix(aspect) {
    const { right, up, forward } = this.axes();
    const eye = this.at.map((x, k) => x - this.distance * forward[k]);
    const tall = 1 / Math.tan(this.fieldOfView / 2), near = this.distance / 100, far = this.distance * 20;
    const depth = (far + near) / (far - near), shift = -2 * far * near / (far - near);
    const rows = [
      [...right.map(x => x * tall / aspect), -dot(right, eye) * tall / aspect],
      [...up.map(x => x * tall), -dot(up, eye) * tall],
      [...forward.map(x => x * depth), -dot(forward, eye) * depth + shift],
      [...forward, -dot(forward, eye)],
    ];
    return new Float32Array([0, 1, 2, 3].flatMap(column => rows.map(row => row[column])));
  }

  drag(dx, dy, pan, height) {
    if (pan) {
      const { right, up } = this.axes(), step = 2 * this.distance * Math.tan(this.fieldOfView / 2) / height;
      this.at = this.at.map((x, k) => x + step * (dy * up[k] - dx * right[k]));
    } else {
      this.azimuth -= 0.006 * dx;
      this.elevation = Math.min(Math.max(this.elevation - 0.006 * dy, -1.5533), 1.5533);
    }
  }
}
