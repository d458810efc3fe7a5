// The replay's controls, and what the rest of the page does with them: any [data-seek] leads to its moment.
"use strict";

function element(tag, attributes = {}, ...inside) {
  const made = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) made.setAttribute(name, value);
  made.append(...inside);
  return made;
}

class Player {
  constructor(box, data) {
    this.box = box;
    this.listeners = [];
    this.picture = element("canvas", { tabindex: "0", "aria-label": "the run in three dimensions" });
    this.words = element("canvas", { class: "words", "aria-hidden": "true" });
    this.stage = element("div", { class: "stage" }, this.picture, this.words);
    box.replaceChildren(this.stage);
    const gl = this.picture.getContext("webgl2", { antialias: true, preserveDrawingBuffer: true });
    if (!gl) {
      box.replaceChildren(element("p", { class: "bad" }, "This browser offers no WebGL 2, so there is no replay here."));
      return;
    }
    this.record = new Record(data);
    this.scene = new Scene(this.record);
    this.canvas = new Canvas(gl, this.record.meshes);
    this.camera = new Camera(data.camera, data.field_of_view);
    this.playing = false;
    this.followed = null;
    this.shown = { numbers: data.count <= 12, trail: 8 * data.speed };
    for (const layer in data.layers) this.shown[layer] = true;
    this.controls(data);
    this.mouse();
    new ResizeObserver(() => this.draw()).observe(this.stage);
    this.update();
  }

  controls({ speed, count, contacts, robots, target_radius, layers }) {
    const { start, end } = this.record;
    this.button = element("button", { type: "button", class: "play", title: "play or pause (space)" }, "Play");
    this.button.addEventListener("click", () => this.toggle());
    this.slider = element("input", {
      type: "range", min: start, max: end, step: "any", value: start, "aria-label": "time", list: "contacts",
    });
    this.slider.addEventListener("input", () => this.seek(Number(this.slider.value)));
    this.clock = element("output", { class: "clock" });
    const speeds = [...new Set([0.1, 0.25, 0.5, 1, 2, 4, 8, 16, speed])].sort((a, b) => a - b);
    this.speed = element("select", { "aria-label": "speed" },
      ...speeds.map(value => element("option", { value }, `${value} ×`)));
    this.speed.value = speed;
    this.follow = element("select", { "aria-label": "camera" }, element("option", { value: "" }, "camera stays"),
      ...(target_radius > 0 ? [element("option", { value: "target" }, "follows target")] : []),
      ...robots.map((_, k) => element("option", { value: k }, `follows robot ${k + 1}`)));
    this.follow.addEventListener("change", () => { this.followed = null; this.draw(); });
    const reset = element("button", { type: "button", title: "the first view again" }, "Reset view");
    reset.addEventListener("click", () => {
      this.camera.reset();
      this.follow.value = "";
      this.draw();
    });
    const names = { ...layers };
    if (count <= 60) names.numbers = "numbers";
    const boxes = Object.entries(names).map(([key, name]) => {
      const box = element("input", { type: "checkbox", name: key });
      box.checked = this.shown[key];
      box.addEventListener("change", () => { this.shown[key] = box.checked; this.draw(); });
      return element("label", {}, box, name);
    });
    const marks = element("datalist", { id: "contacts" }, ...contacts.map(value => element("option", { value })));
    this.box.append(
      element("div", { class: "controls" }, this.button, this.slider, this.clock, this.speed, marks),
      element("div", { class: "controls" }, this.follow, reset, ...boxes,
        element("span", { class: "soft" }, "drag turns, shift-drag moves, wheel zooms")));
  }

  mouse() {
    const picture = this.picture;
    let last = null;
    picture.addEventListener("pointerdown", event => {
      last = [event.clientX, event.clientY];
      picture.setPointerCapture(event.pointerId);
    });
    picture.addEventListener("pointermove", event => {
      if (!last) return;
      const [dx, dy] = [event.clientX - last[0], event.clientY - last[1]];
      last = [event.clientX, event.clientY];
      this.camera.drag(dx, dy, event.shiftKey || event.buttons === 2, picture.clientHeight);
      this.draw();
    });
    for (const name of ["pointerup", "pointercancel"]) picture.addEventListener(name, () => { last = null; });
    picture.addEventListener("contextmenu", event => event.preventDefault());
    picture.addEventListener("wheel", event => {
      event.preventDefault();
      this.camera.distance *= Math.exp(0.001 * event.deltaY);
      this.draw();
    }, { passive: false });
    picture.addEventListener("keydown", event => {
      const steps = { ArrowLeft: -1, ArrowRight: 1 };
      if (event.key === " ") this.toggle();
      else if (event.key in steps) this.seek(this.record.now + steps[event.key] * Number(this.speed.value) / 5);
      else return;
      event.preventDefault();
    });
  }

  toggle() {
    if (!this.playing && this.record.now >= this.record.end) this.seek(this.record.start);
    this.playing = !this.playing;
    this.button.textContent = this.playing ? "Pause" : "Play";
    if (!this.playing) return;
    let before = null;
    const step = now => {
      if (!this.playing) return;
      before ??= now;
      this.seek(this.record.now + Number(this.speed.value) * Math.min(now - before, 200) / 1000);
      before = now;
      if (this.record.now >= this.record.end) this.toggle();
      else requestAnimationFrame(step);
    };
    requestAnimationFrame(step);
  }

  seek(time) {
    this.record.seek(time);
    this.update();
  }

  update() {
    this.slider.value = this.record.now;
    this.clock.textContent = `${this.record.now.toFixed(2)} s of ${this.record.end.toFixed(1)} s`;
    this.draw();
    for (const listener of this.listeners) listener(this.record.now);
  }

  draw() {
    const pixel = window.devicePixelRatio || 1;
    const [width, height] = [this.stage.clientWidth, this.stage.clientHeight].map(x => Math.round(x * pixel));
    if (!width || !height) return;
    for (const canvas of [this.picture, this.words])
      if (canvas.width !== width || canvas.height !== height) Object.assign(canvas, { width, height });
    this.track();
    this.canvas.begin(width, height, this.camera);
    const { robots } = this.scene.draw(this.canvas, this.shown, pixel);
    this.write(robots, pixel);
  }

  track() {  // the camera goes as far as what it follows has gone
    if (this.follow.value === "") return;
    const { record } = this, name = this.follow.value;
    const now = record.place(name === "target" ? record.target : record.robots[Number(name)]);
    if (this.followed) this.camera.at = this.camera.at.map((x, k) => x + now[k] - this.followed[k]);
    else this.camera.at = [...now];
    this.followed = now;
  }

  write(robots, pixel) {  // the robots' numbers
    const [width, height] = [this.words.width, this.words.height], pen = this.words.getContext("2d");
    pen.clearRect(0, 0, width, height);
    if (!this.shown.numbers) return;
    pen.font = `600 ${12 * pixel}px system-ui, sans-serif`;
    pen.textAlign = "center";
    pen.lineWidth = 3 * pixel;
    pen.strokeStyle = "rgba(255, 255, 255, 0.85)";
    pen.fillStyle = "#1c2024";
    const view = this.canvas.view, { up } = this.camera.axes();
    robots.forEach((place, k) => {
      const above = [...place.map((x, i) => x + 1.5 * this.record.robot_radius[k] * up[i]), 1];
      const [x, y, , w] = [0, 1, 2, 3].map(row => above.reduce((sum, v, i) => sum + view[4 * i + row] * v, 0));
      if (w <= 0) return;
      const at = [(x / w + 1) / 2 * width, (1 - y / w) / 2 * height - 3 * pixel];
      pen.strokeText(k + 1, ...at);
      pen.fillText(k + 1, ...at);
    });
  }
}

const replayBox = document.getElementById("replay");
const player = replayBox && new Player(replayBox, JSON.parse(document.getElementById("replay-data").textContent));
if (player && player.record) {
  const asked = /^#t=([\d.]+)$/.exec(location.hash);  // a link to a moment: report.html#t=13.6
  if (asked) player.seek(Number(asked[1]));
  for (const link of document.querySelectorAll("[data-seek]"))
    link.addEventListener("click", event => {
      event.preventDefault();
      player.seek(Number(link.dataset.seek));
      replayBox.scrollIntoView({ behavior: "smooth", block: "center" });
    });
}
