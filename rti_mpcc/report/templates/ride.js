"use strict";
// Data of the ride, see rti_mpcc/report/ride_page.py. Positions are metres from `origin`.
const D = JSON.parse(document.getElementById("data").textContent);
const N = D.t.length, AHEAD = 2.0;  // [s] over which the motion of an obstacle is drawn
const COLORS = { black: "#000000", grey: "#8c8c8c", orange: "#e69f00", sky: "#56b4e9", green: "#009e73", blue: "#0072b2",
  red: "#d55e00", pink: "#cc79a7" };
const byId = (name) => document.getElementById(name);
const status = (k) => D.texts[D.status[k]];
let now = 0, playing = null;

// -- the plane ---------------------------------------------------------------------------------------------

const scene = byId("scene");

function known(k) { return D.x[k] !== null && D.phi[k] !== null; }

// What has to be seen: all poses, goals and routes.
function extent() {
  let low = [Infinity, Infinity], high = [-Infinity, -Infinity];
  const include = (x, y) => {
    low = [Math.min(low[0], x), Math.min(low[1], y)];
    high = [Math.max(high[0], x), Math.max(high[1], y)];
  };
  for (let k = 0; k < N; k++) if (known(k)) include(D.x[k], D.y[k]);
  for (const pose of D.poses) include(pose[0], pose[1]);
  for (const line of [...D.routes.flat(), ...D.walls]) for (let i = 0; i < line.length; i += 2) include(line[i], line[i + 1]);
  const reach = Math.max(...D.body.map(Math.abs)) + 1.0;
  return [low[0] - reach, low[1] - reach, high[0] + reach, high[1] + reach];
}
const VIEW = extent();

// A canvas of the size that it has on the screen; drawing is in CSS pixels.
function fitted(canvas) {
  const scale = window.devicePixelRatio || 1, box = canvas.getBoundingClientRect();
  canvas.width = Math.max(1, Math.round(box.width * scale));
  canvas.height = Math.max(1, Math.round(box.height * scale));
  const c = canvas.getContext("2d");
  c.setTransform(scale, 0, 0, scale, 0, 0);
  return [c, box.width, box.height];
}

function polyline(c, at, points, closed) {
  c.beginPath();
  for (let i = 0; i < points.length; i += 2) {
    const [x, y] = at(points[i], points[i + 1]);
    if (i) c.lineTo(x, y); else c.moveTo(x, y);
  }
  if (closed) c.closePath();
}

function bodyAt(pose) {
  const [x, y, phi] = pose, cos = Math.cos(phi), sin = Math.sin(phi), corners = [];
  for (let i = 0; i < D.body.length; i += 2) {
    corners.push(x + cos * D.body[i] - sin * D.body[i + 1], y + sin * D.body[i] + cos * D.body[i + 1]);
  }
  return corners;
}

function drawScene() {
  const [c, width, height] = fitted(scene);
  const scale = Math.min(width / (VIEW[2] - VIEW[0]), height / (VIEW[3] - VIEW[1]));
  const left = (width - scale * (VIEW[2] - VIEW[0])) / 2, bottom = (height - scale * (VIEW[3] - VIEW[1])) / 2;
  const at = (x, y) => [left + scale * (x - VIEW[0]), height - bottom - scale * (y - VIEW[1])];
  const stroke = (points, color, wide = 1.2, dash = [], closed = false) => {
    polyline(c, at, points, closed);
    c.strokeStyle = color; c.lineWidth = wide; c.setLineDash(dash); c.stroke(); c.setLineDash([]);
  };
  const fill = (points, color, edge) => {
    polyline(c, at, points, true);
    c.fillStyle = color; c.fill();
    if (edge) { c.strokeStyle = edge; c.lineWidth = 1; c.stroke(); }
  };
  c.clearRect(0, 0, width, height);
  if (D.area) {
    if (D.area.boundary) stroke(D.area.boundary, COLORS.black, 1.2, [], true);
    for (const ring of D.area.obstacles) fill(ring, COLORS.grey, COLORS.black);
  }
  for (const line of D.walls) stroke(line, COLORS.black);
  if (D.route[now] !== null) for (const line of D.routes[D.route[now]]) stroke(line, COLORS.orange);
  for (const k of D.obstacles[now]) {
    if (D.outlines[k].length > 4) fill(D.outlines[k], COLORS.grey, COLORS.black);
    else stroke(D.outlines[k], COLORS.black, 3);
  }
  for (const [x, y, vx, vy] of D.moving[now]) stroke([x, y, x + AHEAD * vx, y + AHEAD * vy], COLORS.red, 2, [4, 3]);
  if (D.docked_object) fill(D.docked_object, COLORS.pink, COLORS.black);
  const ellipse = ([x, y, long, short, angle], color) => {
    c.beginPath();
    c.ellipse(...at(x, y), Math.max(scale * long, 1), Math.max(scale * short, 1), -angle, 0, 2 * Math.PI);
    c.strokeStyle = color; c.lineWidth = 1; c.stroke();
  };
  for (const [stamp, accepted, ...place] of D.detections) {
    if (stamp > D.t[now]) continue;
    c.globalAlpha = 0.3;  // the latest of many stands out
    ellipse(place, accepted ? COLORS.green : COLORS.red);
    c.globalAlpha = 1;
    const [px, py] = at(place[0], place[1]);
    c.fillStyle = accepted ? COLORS.green : COLORS.red;
    c.fillRect(px - 1.5, py - 1.5, 3, 3);
  }
  if (D.goal[now] !== null) stroke(bodyAt(D.poses[D.goal[now]]), COLORS.red, 1.5, [6, 4], true);
  if (D.setpoint[now] !== null) stroke(bodyAt(D.poses[D.setpoint[now]]), COLORS.pink, 1.2, [2, 2], true);
  if (D.ellipse[now]) ellipse(D.ellipse[now], COLORS.pink);
  stroke(bodyAt(D.poses[D.target[now]]), COLORS.black, 1, [1, 3], true);
  const driven = [];
  for (let k = 0; k <= now; k++) if (known(k)) driven.push(D.x[k], D.y[k]);
  stroke(driven, COLORS.blue, 1.5);
  if (!known(now)) return;
  const pose = [D.x[now], D.y[now], D.phi[now]], plan = D.plan[now], points = [];
  for (let i = 0, x = pose[0], y = pose[1]; i + 1 < plan.length; i += 2) {
    points.push(x += plan[i] / 100, y += plan[i + 1] / 100);  // each from the one before [cm]
  }
  const body = bodyAt(pose);
  c.globalAlpha = 0.7;
  fill(body, COLORS.sky, COLORS.blue);
  c.globalAlpha = 1;
  const cos = Math.cos(pose[2]), sin = Math.sin(pose[2]);
  for (const [x, y, nx, ny] of D.planes[now]) {  // the edge of a half-plane, a metre to both sides
    const world = (along, across) => [pose[0] + (cos * along - sin * across) / 100, pose[1] + (sin * along + cos * across) / 100];
    stroke([...world(x - ny, y + nx), ...world(x + ny, y - nx)], COLORS.red, 1);
  }
  stroke(points, COLORS.green, 2);
  if (points.length) stroke(bodyAt([...points.slice(-2), plan[plan.length - 1] / 1000]), COLORS.green, 1, [], true);
  const front = [pose[0] + D.wheelbase * cos, pose[1] + D.wheelbase * sin], turned = pose[2] + (D.delta[now] || 0);
  const half = 0.15 * D.wheelbase;
  stroke([front[0] - half * Math.cos(turned), front[1] - half * Math.sin(turned),
    front[0] + half * Math.cos(turned), front[1] + half * Math.sin(turned)], COLORS.black, 3);
  drawScale(c, scale, width, height);
}

// A bar of a round number of metres.
function drawScale(c, scale, width, height) {
  const long = [0.1, 0.2, 0.5, 1, 2, 5, 10, 20, 50, 100].find((each) => each * scale >= 60) || 200;
  c.strokeStyle = c.fillStyle = COLORS.black; c.lineWidth = 2;
  c.beginPath(); c.moveTo(10, height - 10); c.lineTo(10 + long * scale, height - 10); c.stroke();
  c.font = "12px sans-serif"; c.textAlign = "left"; c.fillText(`${long} m`, 10, height - 15);
}

function writeLegend() {
  const entries = [["body", COLORS.blue, COLORS.sky], ["plan and its last body", COLORS.green], ["driven", COLORS.blue],
    ["end of the segment", COLORS.black], ["half-planes", COLORS.red], ["goal setpoint, 3 sigma", COLORS.pink]];
  if (D.routes.length) entries.push(["path or route", COLORS.orange]);
  if (D.simulated) entries.push(["true goal", COLORS.red]);
  if (D.detections.length) entries.push(["detection, accepted, 3 sigma", COLORS.green, COLORS.green],
    ["detection, rejected", COLORS.red, COLORS.red]);
  if (D.moving.some((some) => some.length)) entries.push([`motion of an obstacle in ${AHEAD} s`, COLORS.red]);
  writeKey("legend", entries);
  const seen = [...new Set(D.status)].map((place) => D.texts[place]);
  writeKey("statuses", seen.map((name) => [name, D.colors[name] || COLORS.grey, D.colors[name] || COLORS.grey]));
}

function writeKey(id, entries) {
  for (const [name, line, inside] of entries) {
    const entry = document.createElement("span");
    entry.textContent = name;
    entry.style.setProperty("--line", line);
    if (inside) entry.style.setProperty("--fill", inside);
    byId(id).append(entry);
  }
}

// -- over time ---------------------------------------------------------------------------------------------

const START = D.t[0], END = Math.max(D.t[N - 1], START + 1e-3), MARGIN = 46;
const STEP = [0.1, 0.2, 0.5, 1, 2, 5, 10, 20, 50, 100].find((each) => (END - START) / each <= 10) || 500;  // of the time axis [s]

function cycleAt(time) {
  let low = 0, high = N - 1;
  while (low < high) {
    const middle = (low + high + 1) >> 1;
    if (D.t[middle] <= time + 1e-9) low = middle; else high = middle - 1;
  }
  return low;
}

const charts = D.strips.map((strip) => {
  const canvas = document.createElement("canvas");
  canvas.title = strip.label;
  byId("charts").append(canvas);
  canvas.addEventListener("click", (event) => show(cycleUnder(event)));
  return { strip, canvas };
});

function cycleUnder(event) {
  const box = event.target.getBoundingClientRect();
  const share = (event.clientX - box.left - MARGIN) / Math.max(box.width - MARGIN, 1);
  return cycleAt(START + Math.min(Math.max(share, 0), 1) * (END - START));
}

function drawChart({ strip, canvas }) {
  const last = canvas === charts[charts.length - 1].canvas;
  const [c, width, height] = fitted(canvas), top = 16, low = height - (last ? 18 : 4);
  const finite = strip.values.filter((value) => value !== null);
  let least = Math.min(0, ...finite), most = Math.max(0, ...finite);
  const lines = [[strip.comfort, COLORS.green, [4, 3]], [strip.limit, COLORS.grey, [8, 3, 2, 3]]];
  for (const [value] of lines) {  // a line that would make the curve small is left out
    if (value === null || value > 1.5 * Math.max(most, -least)) continue;
    most = Math.max(most, value);
    if (least < 0) least = Math.min(least, -value);
  }
  if (most - least < 1e-9) most = least + 1;
  const x = (time) => MARGIN + (width - MARGIN) * (time - START) / (END - START);
  const y = (value) => low - (low - top) * (value - least) / (most - least);
  c.clearRect(0, 0, width, height);
  c.font = "11px sans-serif"; c.textBaseline = "middle"; c.fillStyle = "#333"; c.textAlign = "left";
  const value = strip.values[now];
  const bounds = [["comfort", strip.comfort], ["limit", strip.limit]].filter((each) => each[1] !== null);
  const said = bounds.map(([name, level]) => `${name} ${Number(level.toPrecision(3))}`).join(", ");
  c.fillText(`${strip.label}: ${value === null ? "–" : value}${said && `  (${said})`}`, MARGIN, 7);
  c.textAlign = "right";
  const ticks = [least, most];
  if (Math.min(low - y(0), y(0) - top) > 12) ticks.push(0);
  for (const tick of ticks) c.fillText(Number(tick.toPrecision(3)), MARGIN - 4, Math.min(Math.max(y(tick), top), low));
  c.strokeStyle = "#ddd"; c.lineWidth = 1; c.strokeRect(MARGIN, top, width - MARGIN - 1, low - top);
  c.textAlign = "center";
  for (let time = Math.ceil(START / STEP) * STEP; time <= END; time += STEP) {
    c.beginPath(); c.moveTo(x(time), top); c.lineTo(x(time), low); c.stroke();
    if (last && x(time) < width - 20) c.fillText(`${Number(time.toPrecision(6))} s`, x(time), height - 7);
  }
  for (const [level, color, dash] of lines) {
    if (level === null) continue;
    for (const side of least < 0 ? [level, -level] : [level]) {
      if (side > most || side < least) continue;
      c.beginPath(); c.moveTo(MARGIN, y(side)); c.lineTo(width, y(side));
      c.strokeStyle = color; c.lineWidth = 1; c.setLineDash(dash); c.stroke(); c.setLineDash([]);
    }
  }
  c.beginPath();
  let pen = false;
  strip.values.forEach((each, k) => {
    if (each === null) pen = false;
    else if (pen) c.lineTo(x(D.t[k]), y(each));
    else { c.moveTo(x(D.t[k]), y(each)); pen = true; }
  });
  c.strokeStyle = COLORS.blue; c.lineWidth = 1.3; c.stroke();
  c.beginPath(); c.moveTo(x(D.t[now]), top); c.lineTo(x(D.t[now]), low);
  c.strokeStyle = COLORS.black; c.lineWidth = 1; c.stroke();
}

function drawBand() {
  const [c, width, height] = fitted(byId("band"));
  const x = (k) => Math.round(((k < N ? D.t[k] : END) - START) / (END - START) * width);
  for (let k = 0, next; k < N; k = next) {
    for (next = k + 1; next < N && D.status[next] === D.status[k]; next++);
    c.fillStyle = D.colors[status(k)] || COLORS.grey;
    c.fillRect(x(k), 0, Math.max(x(next) - x(k), 1), height);
  }
  c.fillStyle = COLORS.black;
  c.fillRect((D.t[now] - START) / (END - START) * width - 1, 0, 2, height);
}

// -- the cycle that is shown -------------------------------------------------------------------------------

function draw() {
  drawScene();
  charts.forEach(drawChart);
  drawBand();
}

function show(cycle) {
  now = Math.min(Math.max(cycle, 0), N - 1);
  byId("slider").value = now;
  byId("when").textContent = `${D.t[now].toFixed(2)} s, cycle ${now + 1} of ${N}`;
  byId("said").textContent = [`${status(now)} (${D.texts[D.source[now]]})`, D.texts[D.reason[now]]].filter(Boolean).join(": ");
  document.body.dataset.cycle = now;
  document.body.dataset.pose = [D.x[now], D.y[now], D.phi[now]].join(" ");
  history.replaceState(null, "", `#cycle=${now}`);
  draw();
}

function play() {
  if (playing !== null) { cancelAnimationFrame(playing); playing = null; byId("play").textContent = "▶"; return; }
  if (now === N - 1) show(0);
  byId("play").textContent = "⏸";
  const began = performance.now(), from = D.t[now];
  const frame = (time) => {
    const cycle = cycleAt(from + (time - began) / 1000);
    if (cycle !== now) show(cycle);
    if (cycle < N - 1) playing = requestAnimationFrame(frame); else { playing = null; byId("play").textContent = "▶"; }
  };
  playing = requestAnimationFrame(frame);
}

function fromAddress() {
  const found = /cycle=(\d+)/.exec(location.hash);
  return found ? Number(found[1]) : 0;
}

byId("slider").max = N - 1;
byId("slider").addEventListener("input", (event) => show(Number(event.target.value)));
byId("play").addEventListener("click", play);
byId("band").addEventListener("click", (event) => {
  const box = event.target.getBoundingClientRect();
  show(cycleAt(START + (event.clientX - box.left) / box.width * (END - START)));
});
document.addEventListener("keydown", (event) => {
  const steps = { ArrowLeft: -1, ArrowRight: 1 };
  if (event.key in steps) {
    const side = steps[event.key];
    show(event.shiftKey ? cycleAt(D.t[now] + side) : now + side);
    event.preventDefault();
  } else if (event.key === " " && event.target !== byId("play")) { play(); event.preventDefault(); }
});
window.addEventListener("hashchange", () => { if (fromAddress() !== now) show(fromAddress()); });
window.addEventListener("resize", draw);
writeLegend();
show(fromAddress());
