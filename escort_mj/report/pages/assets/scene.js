// What is seen of a run at one moment: bodies, and the marks of marks.py.
"use strict";

const UPRIGHT = [1, 0, 0, 0];
const PIECES = 96;
const AROUND = [[1, 2], [0, 2], [0, 1]];  // axes of a circle, by the one that it goes around

const dashes = (from, to, pieces = 24) =>
  Array.from({ length: pieces }, (_, k) => from.map((x, i) => x + k / (pieces - 1) * (to[i] - x)));

class Scene {
  constructor(record) {
    this.record = record;
    this.ball = this.round(record);
    this.circle = Array.from({ length: PIECES + 1 }, (_, k) => {
      const angle = 2 * Math.PI * k / PIECES;
      return [Math.cos(angle), Math.sin(angle)];
    });
    this.grid = this.lattice();
  }

  round({ meshes }) {  // a ball of our own at the end, for what is no body
    const vertices = [], faces = [], around = 28, stacks = 14;
    for (let i = 0; i <= stacks; i++)
      for (let j = 0; j <= around; j++) {
        const [e, a] = [Math.PI * (i / stacks - 0.5), 2 * Math.PI * j / around];
        vertices.push(Math.cos(e) * Math.cos(a), Math.cos(e) * Math.sin(a), Math.sin(e));
      }
    for (let i = 0; i < stacks; i++)
      for (let j = 0; j < around; j++) {
        const a = i * (around + 1) + j, b = a + around + 1;
        faces.push(a, a + 1, b + 1, a, b + 1, b);
      }
    const text = array => btoa(String.fromCharCode(...new Uint8Array(array.buffer)));
    meshes.push({ vertices: text(new Float32Array(vertices)), faces: text(new Uint16Array(faces)) });
    return meshes.length - 1;
  }

  lattice() {  // lines on the floor, or below a mission in space
    const { floor, low, high, radius } = this.record, [x, y, z, w, a, b, c] = floor;
    const wide = Math.max(high[0] - low[0], high[1] - low[1]);
    const step = radius / 2 * Math.max(1, Math.ceil(wide / (30 * radius)));
    const put = (u, v) => {
      const p = [u - x, v - y, 0], q = [a, b, c], t = cross(q, p).map((s, k) => s + w * p[k]);
      return cross(q, t).map((s, k) => p[k] + 2 * s + [x, y, z][k]);
    };
    const [left, right, front, back] = [
      Math.floor(low[0] / step) * step, Math.ceil(high[0] / step) * step,
      Math.floor(low[1] / step) * step, Math.ceil(high[1] / step) * step,
    ];
    const lines = [], color = [0.42, 0.45, 0.5, 0.22, 1];
    for (let u = left; u <= right + step / 2; u += step) lines.push(...put(u, front), ...put(u, back), ...color);
    for (let v = front; v <= back + step / 2; v += step) lines.push(...put(left, v), ...put(right, v), ...color);
    return lines;
  }

  ring(center, radius, color, width, axes = [0, 1], dashed = false) {
    const lines = [], at = ([cos, sin]) => {
      const place = [...center];
      place[axes[0]] += radius * cos;
      place[axes[1]] += radius * sin;
      return place;
    };
    for (let k = 0; k < PIECES; k += dashed ? 2 : 1)
      lines.push(...at(this.circle[k]), ...at(this.circle[k + 1]), ...color, width);
    return lines;
  }

  draw(canvas, shown, pixel) {
    const record = this.record, { solids } = record;
    const batches = canvas.meshes.map(() => []), veils = canvas.meshes.map(() => []);
    solids.place.forEach((place, k) => {
      const robot = solids.robot[k];
      const color = robot >= 0 && record.isLost(robot) ? [...record.lost_color, 1] : solids.color[k];
      (color[3] < 1 ? veils : batches)[solids.mesh[k]].push(
        ...record.place(place), ...record.turn(solids.turn[k]), ...solids.scale[k], ...color);
    });
    batches.forEach((numbers, mesh) => canvas.solids(mesh, numbers));

    const lines = [...this.grid], discs = [], balls = [];
    for (const mark of record.marks) {
      const look = shown[mark.layer] === false ? null : record.look(mark);
      if (!look) continue;
      const color = look.slice(0, 4), radius = look[4], width = mark.width * pixel, points = record.points(mark);
      if (mark.kind === "disc" && record.floor[3] > 0.99999)
        discs.push(...points[0], ...UPRIGHT, radius, radius, 1e-3, ...color);
      else if (mark.kind === "ball") balls.push(...points[0], ...UPRIGHT, radius, radius, radius, ...color);
      else if (mark.kind === "circle")
        lines.push(...this.ring(points[0], radius, color, width, AROUND[mark.normal], mark.dashed));
      else if (mark.kind === "outline")
        for (const axes of AROUND) lines.push(...this.ring(points[0], radius, [...color.slice(0, 3), 0.3], width, axes));
      else if (mark.kind === "trail") this.trail(lines, mark, color, shown.trail, width);
      else if (mark.kind === "line") this.line(lines, mark.dashed ? dashes(...points) : points, color, width, mark.dashed);
    }
    canvas.solids(this.ball, discs, { flat: 1, seethrough: true });
    canvas.path(lines);
    veils.forEach((numbers, mesh) => canvas.solids(mesh, numbers, { seethrough: true }));
    canvas.solids(this.ball, balls, { flat: 1, seethrough: true });
    return { robots: record.robots.map(place => record.place(place)) };
  }

  line(lines, points, color, width, dashed) {
    for (let k = 0; k + 1 < points.length; k += dashed ? 2 : 1) lines.push(...points[k], ...points[k + 1], ...color, width);
  }

  trail(lines, mark, color, seconds, width) {  // where something was lately, fading
    const record = this.record;
    let first = record.row, [before] = record.points(mark);
    while (first > 0 && record.time[first] > record.now - seconds) first--;
    const stride = Math.max(1, Math.ceil((record.row - first) / 90));
    for (let row = record.row - record.row % stride; row >= first; row -= stride) {
      const [here] = record.points(mark, row), age = (record.now - record.time[row]) / seconds;
      lines.push(...before, ...here, ...color.slice(0, 3), Math.max(0.9 * (1 - age), 0), width);
      before = here;
    }
  }
}
