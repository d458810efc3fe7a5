// What is seen of a run at one moment: bodies, trails, links, safe distances, the escort circle.
"use strict";

const UPRIGHT = [1, 0, 0, 0];
const PIECES = 64;

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

  ground(place, height) { return [place[0], place[1], this.record.floor[2] + height]; }

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
    const record = this.record, { solids, planar } = record;
    const batches = canvas.meshes.map(() => []), veils = canvas.meshes.map(() => []);
    solids.place.forEach((place, k) => {
      const robot = solids.robot[k];
      const color = robot >= 0 && record.raised(robot, LOST) ? [...record.lost_color, 1] : solids.color[k];
      (color[3] < 1 ? veils : batches)[solids.mesh[k]].push(
        ...record.place(place), ...record.turn(solids.turn[k]), ...solids.scale[k], ...color);
    });
    batches.forEach((numbers, mesh) => canvas.solids(mesh, numbers));

    const target = record.place(record.target), lines = [...this.grid];
    const robots = record.robots.map(place => record.place(place));
    const discs = [], balls = [];
    const disc = (place, radius, alpha, color = [0, 0, 0]) => discs.push(
      ...this.ground(place, 0.004), ...UPRIGHT, radius, radius, 1e-3, ...color, alpha);
    if (record.floor[3] > 0.99999) {
      robots.forEach((place, k) => disc(place, 1.15 * record.robot_radius[k], 0.16));
      record.obstacles.forEach((place, k) => disc(record.place(place), 1.1 * record.obstacle_radius[k], 0.16));
      if (record.target_radius > 0) disc(target, 1.15 * record.target_radius, 0.16);
    }
    if (shown.safe) this.safe(lines, disc, pixel);
    if (shown.ring && record.target_radius > 0) this.escort(target, lines, balls, pixel);
    if (shown.links)
      for (const [a, b] of robots.length ? record.pairs() : [])
        lines.push(...robots[a], ...robots[b], 0.3, 0.3, 0.3, 0.4, 1.5 * pixel);
    if (shown.trails) this.trails(lines, shown.trail, pixel);
    robots.forEach((place, k) => {
      const touching = record.raised(k, TOUCHING);
      if (!touching && !record.raised(k, AVOIDING)) return;
      const color = touching ? record.contact_color : record.colors[k], size = 2.2 * record.robot_radius[k];
      balls.push(...place, ...UPRIGHT, size, size, size, ...color, 0.3);
      if (planar) lines.push(...this.ring(place, size, [...color, 0.9], 2 * pixel));
    });
    canvas.solids(this.ball, discs, { flat: 1, seethrough: true });
    canvas.path(lines);
    veils.forEach((numbers, mesh) => canvas.solids(mesh, numbers, { seethrough: true }));
    canvas.solids(this.ball, balls, { flat: 1, seethrough: true });
    return { robots, target };
  }

  safe(lines, disc, pixel) {
    const record = this.record, color = [...record.contact_color, 0.55];
    record.obstacles.forEach((number, k) => {
      const radius = record.safe_radius[k], center = record.place(number);
      if (radius <= 0) return;
      if (record.obstacle_radius[k] > 0 && record.planar) {
        disc(center, radius, 0.06, record.contact_color);
        lines.push(...this.ring(this.ground(center, 0.01), radius, color, 1.5 * pixel));
      } else if (record.obstacle_radius[k] > 0) {
        for (const axes of [[0, 1], [1, 2], [0, 2]])
          lines.push(...this.ring(center, radius, [...record.contact_color, 0.3], pixel, axes));
      } else if (record.rims.length) {
        const rim = record.rims[k].map(p => this.ground([center[0] + p[0], center[1] + p[1]], 0.01));
        rim.slice(1).forEach((p, i) => lines.push(...rim[i], ...p, ...color, 1.5 * pixel));
      }
    });
  }

  escort(target, lines, balls, pixel) {
    const { radius, planar } = this.record, color = [0.3, 0.3, 0.3, planar ? 0.8 : 0.45];
    if (planar) return lines.push(...this.ring(this.ground(target, 0.012), radius, color, 2 * pixel, [0, 1], true));
    balls.push(...target, ...UPRIGHT, radius, radius, radius, 0.55, 0.65, 0.8, 0.1);
    for (const axes of [[0, 1], [1, 2], [0, 2]]) lines.push(...this.ring(target, radius, color, pixel, axes, true));
  }

  trails(lines, seconds, pixel) {  // where everyone was lately, fading
    const record = this.record;
    let first = record.row;
    while (first > 0 && record.time[first] > record.now - seconds) first--;
    const stride = Math.max(1, Math.ceil((record.row - first) / 90));
    const one = (place, color, width) => {
      let before = record.place(place);
      for (let row = record.row - record.row % stride; row >= first; row -= stride) {
        const here = record.at(place, row), age = (record.now - record.time[row]) / seconds;
        lines.push(...before, ...here, ...color, Math.max(0.9 * (1 - age), 0), width * pixel);
        before = here;
      }
    };
    if (record.target_radius > 0) one(record.target, record.target_color, 2);
    record.robots.forEach((place, k) => {
      one(place, record.raised(k, LOST) ? record.lost_color : record.colors[k], 3);
    });
  }
}
