// What a browser does with the page of a run, and tells of it.
const picture = () => {
  const copy = document.createElement("canvas");
  Object.assign(copy, { width: player.picture.width, height: player.picture.height });
  const pen = copy.getContext("2d");
  pen.drawImage(player.picture, 0, 0);
  return pen.getImageData(0, 0, copy.width, copy.height).data;
};
const seen = color => {  // pixels of about this hue
  const data = picture(), [r, g, b] = color;
  let count = 0;
  for (let k = 0; k < data.length; k += 4) {
    const [x, y, z] = [data[k] / 255, data[k + 1] / 255, data[k + 2] / 255];
    const size = Math.hypot(x, y, z) * Math.hypot(r, g, b);
    if ((x * r + y * g + z * b) / size > 0.995 && Math.hypot(x - 0.95, y - 0.96, z - 0.97) > 0.25) count++;
  }
  return count;
};
const places = times.map(time => {
  player.seek(time);
  return player.record.robots.map(place => player.record.place(place));
});
document.querySelector("[data-seek]").click();
const sought = player.record.now, before = picture();
const hues = player.record.colors.map(seen);
player.follow.value = "2";
player.draw();
const turned = picture().some((value, k) => value !== before[k]);
const curves = signalsBox.querySelectorAll("canvas").length;
const choice = signalsBox.querySelector("select");
choice.value = "3";
choice.dispatchEvent(new Event("change"));
player.speed.value = 8;
player.toggle();
for (let i = 0; i < 100 && player.record.now <= 2.5 + 1e-3; i++)
  await new Promise(done => setTimeout(done, 100));
tell({
  places, sought, hues, turned, curves, label: signalsBox.querySelector(".u-legend").textContent,
  played: player.record.now, error: player.canvas.gl.getError(),
  widths: [...document.images].map(image => image.naturalWidth),
});
