"use strict";
// Plays the runs: everything is drawn from the numbers of the recordings.
const { quantity, runs } = JSON.parse(document.getElementById("data").textContent);
const find = (id) => document.getElementById(id);
const [slider, clock, button, told] = ["run", "time", "play", "told"].map(find);
let run = runs[0], now = 0, playing = false, last = 0;

// An element of SVG with attributes, as text.
function element(name, attributes, content = "") {
  const list = Object.entries(attributes).map(([key, value]) => ` ${key}="${value}"`);
  return `<${name}${list.join("")}>${content}</${name}>`;
}

function safe(text) {
  const signs = { "&": "&amp;", "<": "&lt;", ">": "&gt;", '"': "&quot;" };
  return String(text).replace(/[&<>"]/g, (sign) => signs[sign]);
}

function label(x, y, text, more = {}) {
  return element("text", { x, y, "font-size": 14, "text-anchor": "middle", ...more }, safe(text));
}

// The index of the last time up to now; -1 before the first.
function upTo(times, at) {
  let [low, high] = [0, times.length];
  while (low < high) {
    const middle = (low + high) >> 1;
    if (times[middle] <= at) low = middle + 1; else high = middle;
  }
  return low - 1;
}

function rateOf(node) {
  return node.rates.filter(([at]) => at <= now).at(-1)[1];
}

// The width of the page for drawings (px), in which a text of 14 is 14 px high.
function roomy() {
  return find("player").clientWidth || 700;
}

// The places of nodes and topics side by side, and one below the other where text beside
// nodes would be too small to read.
function places() {
  const step = 340, wide = 150, high = 54;
  const width = 40 + (run.nodes.length - 1) * step + wide;
  if (width * 10 <= roomy() * 14) {
    const top = 60, x = (node) => 20 + node * step;
    return {
      wide, high, size: [width, top + high + 50], node: (number) => [x(number), top],
      topic(from, to, near, row) {
        const middle = (x(from) + x(to) + wide) / 2;
        const y = near ? top + high / 2 : top + high + 26 + 30 * row;
        const path = near ? `M${x(from) + wide} ${y}H${x(to) - 4}`
          : `M${x(from) + wide / 2} ${top + high}V${y}H${x(to) + wide / 2}V${top + high + 4}`;
        const line = near ? top : y - 8;
        return { path, texts: [[middle, line - 2], [middle, line + 52], [middle, line + 72]], anchor: "middle" };
      },
    };
  }
  const tall = high + 76, left = 8, y = (node) => 8 + node * tall;
  return {
    wide, high, size: [Math.min(roomy(), 420), (run.nodes.length - 1) * tall + high + 16], node: (number) => [left, y(number)],
    topic(from, to, near, row) {
      const right = left + wide + 14 * (row + 1);
      const line = near ? y(from) + high + 24 : (y(from) + y(to) + high) / 2 - 20;
      const path = near ? `M${left + wide / 2} ${y(from) + high}V${y(to) - 4}`
        : `M${left + wide} ${y(from) + high / 2}H${right}V${y(to) + high / 2}H${left + wide + 4}`;
      const text = (near ? left + wide / 2 : right) + 10;
      return { path, texts: [[text, line], [text, line + 19], [text, line + 38]], anchor: "start" };
    },
  };
}

function drawGraph() {
  const { wide, high, size, node: corner, topic: route } = places();
  let out = "", words = [];
  run.topics.forEach((topic, row) => {
    const place = upTo(topic.at, now);
    const [sent, dropped] = place < 0 ? [0, 0] : [topic.published[place], topic.dropped[place]];
    const [from, to] = [topic.from[0] ?? 0, topic.to[0]];
    const { path, texts, anchor } = route(from, to, to === from + 1, row);
    out += element("path", { class: "wire", d: path, "marker-end": "url(#tip)" });
    const line = (number, text, more) => label(...texts[number], text, { "text-anchor": anchor, ...more });
    out += line(0, topic.name, { "font-weight": "bold" });
    out += line(1, `${sent} sent, queue ${topic.depth}`);
    if (dropped > 0) out += line(2, `✖ ${dropped} dropped`, { class: "drops" });
    words.push(`${topic.name}: ${sent} sent, ${dropped} dropped`);
  });
  run.nodes.forEach((node, number) => {
    const tick = upTo(node.ticks, now);
    const lit = tick >= 0 && now - node.ticks[tick] < (playing ? 60 : 1);
    const [x, y] = corner(number);
    out += element("rect", { class: lit ? "node lit" : "node", x, y, width: wide, height: high, rx: 8 });
    out += label(x + wide / 2, y + 24, node.name, { "font-weight": "bold" });
    out += label(x + wide / 2, y + 44, `${rateOf(node)} Hz`);
  });
  const tip = element("marker", { id: "tip", viewBox: "0 0 8 8", refX: 6, refY: 4, markerWidth: 8, markerHeight: 8, orient: "auto-start-reverse" }, element("path", { d: "M0 0L8 4L0 8z", fill: "currentColor" }));
  const graph = find("graph");
  graph.setAttribute("viewBox", `0 0 ${size.join(" ")}`);
  graph.setAttribute("aria-label", `the graph: ${run.nodes.map((node) => node.name + " at " + rateOf(node) + " Hz").join(", ")}; ${words.join("; ")}`);
  graph.innerHTML = element("defs", {}, tip) + out;
}

// A shape of the plant; up is up.
function shape([style, kind, ...n], thin) {
  const line = { class: style };
  if (kind === "line") return element("line", { ...line, x1: n[0], y1: -n[1], x2: n[2], y2: -n[3] });
  if (kind === "circle") return element("circle", { ...line, cx: n[0], cy: -n[1], r: n[2] });
  if (kind === "box") {
    const turn = `rotate(${-n[4] * 180 / Math.PI} ${n[0]} ${-n[1]})`;
    return element("rect", { ...line, x: n[0] - n[2], y: -n[1] - n[3], width: 2 * n[2], height: 2 * n[3], transform: turn });
  }
  if (kind === "outline") {
    const corners = n.map((number, place) => (place % 2 ? -number : number));
    return element("polygon", { ...line, points: corners.join(" ") });
  }
  return label(n[0], -n[1] + 12 * thin, n[2], { "font-size": 13 * thin });
}

function drawPlant() {
  const { view, still, moving, at } = run.plant;
  const plant = find("plant");
  plant.parentElement.hidden = !view;
  if (!view) return;
  const [left, bottom, right, top] = view;
  const [width, height] = [right - left, top - bottom];
  const thin = width / Math.min(roomy(), 500);
  const place = Math.max(0, upTo(at, now));
  plant.setAttribute("viewBox", `${left - 0.06 * width} ${-top - 0.05 * height} ${1.12 * width} ${height * 1.25}`);
  plant.setAttribute("class", run.lost && now >= run.end ? "lost" : "");
  plant.innerHTML = [...still, ...(moving[place] ?? [])].map((part) => shape(part, thin)).join("");
  plant.setAttribute("aria-label", "the plant, drawn to scale");
}

// A curve over the whole run, with the part up to now in colour.
function drawCurve(id, times, values, limits, unit) {
  const [width, height, left] = [Math.min(roomy(), 560), 170, 64];
  const known = values.filter((value) => value !== null);
  const shown = [...known, ...(limits ?? []), ...(unit === "ms" ? [20] : []), 0];
  const [least, most] = [Math.min(...shown), Math.max(...shown)];
  const span = most - least || 1;
  const x = (at) => left + (at / Math.max(run.end, 1)) * (width - left - 10);
  const y = (value) => 28 + ((most - value) / span) * (height - 56);
  const points = (until) => times.slice(0, until).map((at, place) => [at, values[place]])
    .filter(([, value]) => value !== null).map(([at, value]) => `${x(at).toFixed(1)},${y(value).toFixed(1)}`).join(" ");
  const place = upTo(times, now);
  let out = element("line", { class: "axis", x1: left, x2: width, y1: y(0), y2: y(0) });
  for (const limit of limits ?? []) {
    out += element("line", { class: "limit", x1: left, x2: width, y1: y(limit), y2: y(limit) });
    out += label(left - 6, y(limit) + 5, unit === "ms" ? Math.round(limit) : Number(limit.toPrecision(4)), { "text-anchor": "end" });
  }
  out += label(left - 6, y(0) + 5, 0, { "text-anchor": "end" });
  const free = (limits ?? []).every((limit) => y(limit) - y(most) > 14);
  if (most > 0 && free) out += label(left - 6, y(most) + 5, Math.round(most), { "text-anchor": "end" });
  out += element("polyline", { class: "all", points: points(times.length) });
  out += element("polyline", { class: "past", points: points(place + 1) });
  out += element("line", { class: "axis", x1: x(now), x2: x(now), y1: 20, y2: height - 24 });
  out += label(width - 10, height - 6, `${(run.end / 1000).toFixed(2)} s`, { "text-anchor": "end" });
  const value = place < 0 || values[place] === null ? "none yet" : `${values[place].toFixed(1)} ${unit}`;
  out += label(Math.min(Math.max(x(now), left + 50), width - 60), 14, value, { "font-weight": "bold" });
  const chart = find(id);
  chart.setAttribute("viewBox", `0 0 ${width} ${height}`);
  chart.setAttribute("aria-label", `${value} at ${(now / 1000).toFixed(2)} s, between ${least.toFixed(1)} and ${most.toFixed(1)} over the run`);
  chart.innerHTML = out;
}

function draw() {
  drawGraph();
  drawPlant();
  const { signal, plant } = run;
  find("signal").parentElement.hidden = !signal;
  if (signal) {
    find("signal").nextElementSibling.textContent = `${signal.name} (${signal.unit})`;
    drawCurve("signal", signal.at, signal.value, signal.limits, signal.unit);
  }
  const aged = plant.age.some((age) => age !== null);
  find("age").parentElement.hidden = !aged;
  find("limit").hidden = !run.limits;
  const limits = run.limits?.map(([ms, what]) => `above ${Math.round(ms)} ms ${what}`) ?? [];
  find("limit").textContent = `; dashed lines: ${limits.join(", ")}`;
  if (aged) drawCurve("age", plant.at, plant.age, run.limits?.map(([ms]) => ms), "ms");
  clock.value = now;
  clock.setAttribute("aria-valuetext", `${(now / 1000).toFixed(2)} seconds`);
  find("now").textContent = `${(now / 1000).toFixed(2)} s`;
}

// Read out by a screen reader: at a new run, at a pause and at the end only.
function tell(over) {
  const name = quantity && run.setting ? `${quantity} ${run.setting}: ` : "";
  const drops = run.topics.map((topic) => {
    const place = upTo(topic.at, over ? Infinity : now);
    return `${topic.name} ${place < 0 ? 0 : topic.dropped[place]} dropped`;
  });
  const ages = run.plant.age.filter((age) => age !== null);
  const mean = ages.length ? ` The mean push age of the last second was ${ages[ages.length - 1].toFixed(1)} ms.` : "";
  const state = over ? run.verdict : `at ${(now / 1000).toFixed(2)} s`;
  told.textContent = `${name}${state}. ${drops.join(", ")}.${over ? mean : ""}`;
  told.className = over && run.lost ? "lost" : "";
}

function play(on) {
  playing = on;
  button.textContent = on ? "Pause" : "Play";
  if (on && now >= run.end) now = 0;
  if (on) requestAnimationFrame((at) => { last = at; requestAnimationFrame(frame); });
}

function frame(at) {
  if (!playing) return;
  now = Math.min(run.end, now + (at - last) * Number(find("speed").value));
  last = at;
  if (now >= run.end) { play(false); tell(true); }
  draw();
  if (playing) requestAnimationFrame(frame);
}

function choose(number) {
  run = runs[number];
  now = 0;
  clock.max = run.end;
  find("choice").querySelector("output").textContent = run.setting || run.title;
  slider.setAttribute("aria-valuetext", run.setting || run.title);
  find("push").hidden = !run.plant.moving.some((parts) => parts.some(([style]) => style === "action"));
  find("speed").value = run.end < 3000 ? "0.1" : "1";
  play(false);
  tell(false);
  draw();
}

slider.max = runs.length - 1;
find("choice").hidden = runs.length < 2;
find("choice").querySelector("label").textContent = quantity || "run";
slider.addEventListener("input", () => choose(Number(slider.value)));
clock.addEventListener("input", () => { play(false); now = Number(clock.value); draw(); });
clock.addEventListener("change", () => tell(now >= run.end));
button.addEventListener("click", () => { play(!playing); if (!playing) tell(false); });
addEventListener("resize", draw);
find("picture").hidden = true;
find("player").hidden = false;
const drops = runs.some(({ topics }) => topics.some(({ dropped }) => dropped.at(-1) > 0));
find("try").textContent = "Try: play it at speed 0.1 and "
  + (drops ? "stop at the first ✖: how old is the newest reading that the policy has? " : "watch the push age. ")
  + (runs.length < 2 ? "Then drag the run time to the end: what did the push age do before it?"
    : "Then move the first slider: between which two runs does the end change, and what does the push age do before it?");
slider.value = 0;
choose(0);
