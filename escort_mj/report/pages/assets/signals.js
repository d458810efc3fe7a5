// Signals over time, drawn by uPlot; a click leads the replay to its moment, and the replay moves the line.
"use strict";

class Signals {
  constructor(box, data) {
    this.box = box;
    this.data = data;
    this.time = [...unpack(data.time, Float32Array)];
    this.choice = element("select", { "aria-label": "signal" },
      ...data.signals.map((signal, k) => element("option", { value: k }, `${signal.name} [${signal.unit}]`)));
    this.scale = element("input", { type: "checkbox" });
    this.room = element("div", { class: "plot" });
    box.replaceChildren(
      element("div", { class: "controls" }, this.choice, element("label", {}, this.scale, "logarithmic"),
        element("span", { class: "soft" },
          "drag zooms, double click shows all; click moves the replay; a click on a name hides its curve")),
      this.room);
    this.choice.addEventListener("change", () => this.show());
    this.scale.addEventListener("change", () => this.show());
    new ResizeObserver(() => this.plot.setSize(this.size())).observe(this.room);
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => this.show());
    this.show();
  }

  size() { return { width: Math.max(this.room.clientWidth, 200), height: 300 }; }

  show() {
    const signal = this.data.signals[Number(this.choice.value)], log = this.scale.checked;
    const ink = getComputedStyle(this.box).color, faint = "rgba(128, 128, 128, 0.25)";
    const columns = signal.curves.map(text => [...unpack(text, Float32Array)]
      .map(value => Number.isFinite(value) && (!log || value > 0) ? value : null));
    const digits = value => value === null || value === undefined ? "-" : `${Number(value.toPrecision(4))}`;
    const axis = { stroke: ink, grid: { stroke: faint, width: 1 }, ticks: { stroke: faint, width: 1 } };
    const options = {
      ...this.size(),
      scales: { x: { time: false }, y: { distr: log ? 3 : 1 } },
      axes: [{ ...axis, label: "time [s]" }, { ...axis, label: `[${signal.unit}]`, size: 60 }],
      series: [
        { label: "time", value: (_, value) => value === null ? "-" : `${value.toFixed(2)} s` },
        ...signal.curves.map((_, k) => ({
          label: this.data.names[k], stroke: this.data.colors[k], width: 1.4, points: { show: false },
          value: (_, value) => digits(value),
        })),
      ],
      cursor: { y: false },
      hooks: { draw: [plot => this.line(plot, ink)], ready: [plot => this.clicks(plot)] },
    };
    if (this.plot) this.plot.destroy();
    this.plot = new uPlot(options, [this.time, ...columns], this.room);
  }

  clicks(plot) {
    let from = 0;
    plot.over.addEventListener("mousedown", event => { from = event.clientX; });
    plot.over.addEventListener("mouseup", event => {
      if (Math.abs(event.clientX - from) > 3 || !this.player) return;
      this.player.seek(plot.posToVal(event.clientX - plot.over.getBoundingClientRect().left, "x"));
    });
  }

  line(plot, ink) {  // where the replay is
    if (!this.player) return;
    const { left, top, width, height } = plot.bbox, x = Math.round(plot.valToPos(this.player.record.now, "x", true));
    if (x < left || x > left + width) return;
    plot.ctx.fillStyle = ink;
    plot.ctx.fillRect(x, top, Math.max(1, Math.round(devicePixelRatio)), height);
  }

  follow(player) {
    this.player = player;
    player.listeners.push(() => this.plot.redraw(false, false));
    this.plot.redraw(false, false);
  }
}

const signalsBox = document.getElementById("signals");
if (signalsBox) {
  const signals = new Signals(signalsBox, JSON.parse(document.getElementById("signals-data").textContent));
  if (player && player.record) signals.follow(player);
}
