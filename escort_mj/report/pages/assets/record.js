// Plays a recorded run in WebGL. Numbers come from replay_data.py; lengths in meters, angles in radians.
"use strict";

function unpack(text, Kind) {
  const bytes = Uint8Array.from(atob(text), letter => letter.charCodeAt(0));
  return new Kind(bytes.buffer);
}


class Record {
  constructor(data) {
    Object.assign(this, data);
    this.time = unpack(data.time, Float32Array);
    this.lost = unpack(data.lost, Uint8Array);
    for (const mark of this.marks) mark.shown = mark.shown && unpack(mark.shown, Uint8Array);
    this.steps = unpack(data.tracks, Uint16Array);
    this.solids.turn = data.solids.turn.map(turn => typeof turn === "string" ? unpack(turn, Int16Array) : turn);
    this.last = this.time.length - 1;
    this.start = this.time[0];
    this.end = this.time[this.last];
    this.seek(this.start);
  }

  seek(time) {
    this.now = Math.min(Math.max(time, this.start), this.end);
    let low = 0, high = this.last;
    while (low < high) {
      const middle = (low + high + 1) >> 1;
      if (this.time[middle] <= this.now) low = middle; else high = middle - 1;
    }
    this.row = low;
    this.next = Math.min(low + 1, this.last);
    const gap = this.time[this.next] - this.time[low];
    this.share = gap > 0 ? (this.now - this.time[low]) / gap : 0;
  }

  at(place, row) {  // a place at a recorded moment
    if (place < 0) return this.still[-1 - place];
    const first = 3 * (place * this.time.length + row), found = [0, 0, 0];
    for (let k = 0; k < 3; k++)
      found[k] = this.low[k] + (this.high[k] - this.low[k]) * this.steps[first + k] / 65535;
    return found;
  }

  place(place) {  // a place now
    const a = this.at(place, this.row), b = this.at(place, this.next);
    return a.map((x, k) => x + this.share * (b[k] - x));
  }

  turn(turns) {  // an orientation now: w, x, y, z
    if (turns.length === 4) return turns;
    const now = [0, 0, 0, 0];
    for (let k = 0; k < 4; k++)
      now[k] = (1 - this.share) * turns[4 * this.row + k] + this.share * turns[4 * this.next + k];
    const length = Math.hypot(...now) || 1;
    return now.map(x => x / length);
  }

  isLost(robot) { return this.lost[this.row * this.count + robot] !== 0; }

  look(mark) {  // red, green, blue, opacity and radius of a mark now; nothing where it is not seen
    if (mark.shown && !mark.shown[this.row]) return null;
    let found = mark.looks[0][1];
    for (const [row, look] of mark.looks) if (row <= this.row) found = look;
    return found;
  }

  points(mark, row = null) {  // of a mark, now or at a recorded moment
    const { rim, height } = mark;
    let points = mark.points.map(place => row === null ? this.place(place) : this.at(place, row));
    if (rim.length) points = rim.map(from => from.map((x, k) => x + points[0][k]));
    return height === null ? points : points.map(([x, y]) => [x, y, height]);
  }
}
