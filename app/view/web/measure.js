// SPDX-License-Identifier: BSD-3-Clause
"use strict";
// Measurements: places are touched on the picture, temperatures come from the field and from every frame that sees them.
const measureTools = {
  spot: { words: "Spot", places: 1, say: ["touch the place"] },
  box: { words: "Box", places: 2, say: ["touch one corner", "touch the corner across"] },
  line: { words: "Line", places: 2, say: ["touch where it begins", "touch where it ends"] },
  polygon: { words: "Polygon", places: 3, open: true, say: ["touch the first corner", "touch the next corner", "touch the next corner"] },
  difference: { words: "Difference", places: 2, say: ["touch the first place", "touch the place to take from it"] },
  distance: { words: "Distance", places: 2, say: ["touch where it begins", "touch where it ends"] },
  hottest: { words: "Hottest", places: 0 },
  coldest: { words: "Coldest", places: 0 },
};

/// Several viewers may measure; who is refused for now asks again.
async function askInTurn(path, body) {
  for (let tries = 0; ; ++tries) {
    try { return await (await ask(path, body)).json(); } catch (error) {
      if (error.status !== 503 || tries > 60) throw error;
      await new Promise(done => setTimeout(done, 500));
    }
  }
}

class Measuring {
  constructor(scene, surface, rest) {
    this.facts = scene; this.surface = surface; this.rest = rest;
    this.list = []; this.tool = null; this.places = [];
    $("measure-section").hidden = !scene.thermal || scene.gray;
    if ($("measure-section").hidden) return;
    this.markTool = choices($("tools"), Object.entries(measureTools).map(([k, t]) => [k, t.words]), null, kind => this.take(kind));
    $("save-measurements").onclick = () => this.save();
    $("reload-measurements").onclick = () => this.reload();
    $("close-polygon").onclick = () => this.finish();
    viewer.onPlace = place => this.touched(place);
    viewer.drawMarks = (context, width, height) => this.drawOn(context, width, height);
    surface.controls.addEventListener("change", () => this.drawMarks());
    viewer.onPicture.push(() => this.drawMarks());
    this.reload();
  }

  say(words, bad) { $("measure-words").textContent = words; $("measure-words").className = bad ? "warning" : ""; $("hint").textContent = this.tool && $("panel").hidden ? words : ""; }

  take(kind) {
    const tool = measureTools[kind];
    this.places = [];
    if (!tool.places) { this.tool = null; this.markTool(null); this.hottestOrColdest(kind); return; }
    this.tool = this.tool === kind ? null : kind;
    this.markTool(this.tool);
    this.say(this.tool ? tool.say[0] : "");
    $("close-polygon").hidden = true;
    if (this.tool && innerWidth < 600) { $("panel").hidden = true; $("menu").setAttribute("aria-expanded", false); this.say(tool.say[0]); }
    this.drawMarks();
  }

  hottestOrColdest(kind) {
    const text = $("spot-count").value.trim(), count = Number(text);
    if (!Number.isInteger(count) || count < 1) { this.say(`places: '${text}' is no number of places`, true); return; }
    this.measure({ kind, count });
  }

  /// True when a tool is in hand: the touch was its.
  touched(place) {
    if (!this.tool) return false;
    this.place(place);
    return true;
  }
  async place(place) {
    // At the size of the rested picture, which was touched: a stage may have more pixels than the server renders.
    const kind = this.tool, tool = measureTools[kind], [width, height] = this.rest.size(1);
    if (tool.open && this.places.length >= tool.places) {
      const first = this.surface.onScreen(new THREE.Vector3(...this.places[0]));
      if (first && Math.hypot(first.x - place.x, first.y - place.y) < 20) { this.finish(); return; }
    }
    try {
      // Beside the mesh (it ends where the object does), or before it is there, the field says where the surface is.
      const point = this.surface.meshAt(place.u, place.v)
        || (await askInTurn("/pick", { ...this.surface.shot(width, height), u: place.u * width, v: place.v * height })).point;
      if (this.tool !== kind) return;
      this.places.push(point);
      if (this.places.length < tool.places) { this.say(tool.say[this.places.length]); this.drawMarks(); return; }
      if (!tool.open) { await this.finish(); return; }
      $("close-polygon").hidden = false;
      this.say("touch the next corner, or the first one again to end");
      this.drawMarks();
    } catch (error) { this.say(error.message, true); }
  }
  /// All places are there: they are measured.
  async finish() {
    const kind = this.tool, places = this.places.map(point => ({ point }));
    this.tool = null; this.places = []; this.markTool(null);
    $("close-polygon").hidden = true;
    await this.measure(kind === "box" ? { kind, box: this.boxOf(places[0].point, places[1].point) }
      : kind === "difference" ? { kind, of: places.map(p => ({ kind: "spot", places: [p] })) } : { kind, places });
  }

  /// What was typed of the surface, the way to it and what the camera was set to; absent: as recorded.
  parameters() {
    const number = id => { const text = $(id).value.trim(), value = Number(text); if (text && !Number.isFinite(value)) throw new Error(`${$(id).dataset.words}: '${text}' is no number`); return text ? value : null; };
    const table = ids => {
      const values = {};
      for (const [key, id, stored] of ids) if (number(id) !== null) values[key] = stored ? stored(number(id)) : number(id);
      return Object.keys(values).length ? values : null;
    };
    const object = table([["emissivity", "emissivity"], ["reflected_k", "reflected", toKelvin], ["distance_m", "distance"], ["atmospheric_k", "air", toKelvin], ["relative_humidity", "humidity", percent => percent / 100]]);
    const recorded = table([["emissivity", "recorded-emissivity"], ["reflected_k", "recorded-reflected", toKelvin]]);
    return { ...(object && { object }), ...(recorded && { recorded }) };
  }
  withParameters(request) {
    const { object, recorded, ...plain } = request;
    if (plain.kind === "distance") return plain;
    return plain.of ? { ...plain, of: plain.of.map(part => this.withParameters(part)) } : { ...plain, ...this.parameters() };
  }

  /// Along the world's axes; flat ones get a tenth of their diagonal, or they would hold no surface.
  boxOf(a, b) {
    const diagonal = Math.hypot(...a.map((x, i) => x - b[i]));
    return { center: a.map((x, i) => (x + b[i]) / 2), size: a.map((x, i) => Math.max(Math.abs(x - b[i]), 0.1 * diagonal)) };
  }

  async measure(request) {
    this.say("measuring …");
    try {
      const measured = await askInTurn("/measure", this.withParameters(request));
      this.list.push({ ...measured, name: "", label: "" });
      this.say("");
      this.show();
    } catch (error) { this.say(error.message, true); }
  }

  /// The same place by the parameters that stand there now; what is saved is replaced.
  async again(m) {
    this.say("measuring …");
    try {
      const request = this.withParameters(m.request);
      if (m.name) { this.saved(await askInTurn("/measurements/add", { ...request, name: m.name })); return; }
      Object.assign(m, await askInTurn("/measure", request));
      this.say("");
      this.show();
    } catch (error) { this.say(error.message, true); }
  }
  async remove(m) {
    try { this.saved(await askInTurn("/measurements/remove", { name: m.name })); } catch (error) { this.say(error.message, true); }
  }
  saved(list) { this.list = [...list, ...this.list.filter(m => !m.name)]; this.say(""); this.show(); }

  async save() {
    const open = this.list.filter(m => !m.name);
    if (!open.length) { this.say("everything is saved"); return; }
    // The server would put it in the other's place.
    const taken = open.find((m, i) => m.label && (this.list.some(o => o.name === m.label) || open.findIndex(o => o.label === m.label) < i));
    if (taken) { this.say(`the name '${taken.label}' is taken: choose another, or remove that measurement`, true); return; }
    this.say("saving …");
    try {
      for (const m of open) { await askInTurn("/measurements/add", m.label ? { ...m.request, name: m.label } : m.request); m.name = m.label || "saved"; }
      await this.reload();
      this.say("saved");
    } catch (error) { this.say(error.message, true); }
  }
  async reload() {
    try {
      this.saved(await askInTurn("/measurements"));
    } catch (error) { this.say(error.message, true); this.show(); }
  }

  readingWords(reading) {
    if (!reading) return "";
    const frames = reading.frame_count, field = reading.field_k === null ? "" : `field ${shownTemperature(reading.field_k)}`;
    if (reading.temperature_k === null) return "no frame sees it" + (field ? "; " + field : "");
    const range = reading.points > 1 ? ` (${shownTemperature(reading.min_k)} to ${shownTemperature(reading.max_k)})` : "";
    return `${shownTemperature(reading.temperature_k)}${reading.uncertainty_k === null ? "" : " ± " + shownDifference(reading.uncertainty_k)}${range} · ${frames} frame${frames === 1 ? "" : "s"} · ${field}`;
  }
  /// What stands behind a temperature: every frame that sees the place, each a touch away.
  frames(reading) {
    const box = element("details"), list = element("div"), count = reading.frames.length;
    const parts = [`spread between them ${shownDifference(reading.spread_k, 2)}`, `seen ${reading.angle_deg === null ? "–" : reading.angle_deg.toFixed(0) + "°"} from the normal`];
    if (reading.points > 1) parts.unshift(`over ${reading.points} points standard deviation ${shownDifference(reading.standard_deviation_k, 2)}`);
    box.append(element("summary", count === 1 ? "The frame" : `The ${count} frames`), element("p", parts.join(", ")), list);
    box.ontoggle = () => {
      if (!box.open || list.childElementCount) return;
      for (const line of reading.frames) {
        const item = element("div", undefined, "item"), words = element("div", `${shownTemperature(line.mean_k)} · ${line.angle_deg === null ? "–" : line.angle_deg.toFixed(0) + "°"}`, "words");
        const remarks = [line.used ? "" : "left out: too far from the others", line.doubtful ? "pose in doubt" : ""].filter(Boolean).join(", ");
        if (remarks) words.append(element("small", remarks));
        const index = this.facts.views.findIndex(v => v.name === line.frame);
        item.append(words, index < 0 ? element("span", line.frame) : button(line.frame.split("/").pop(), () => viewer.photo.open(index)));
        list.append(item);
      }
    };
    return box;
  }
  words(m) {
    const a = m.answer;
    if (a.kind === "difference") return `${shownDifference(a.difference_k)}${a.uncertainty_k === null ? "" : " ± " + shownDifference(a.uncertainty_k)}`;
    if (a.kind === "distance") return a.distance_m === null ? `${a.distance.toFixed(3)}${a.distance_uncertainty == null ? "" : " ± " + a.distance_uncertainty.toFixed(3)} units: the run's scale is not known` : `${a.distance_m.toFixed(3)} m${a.distance_uncertainty_m == null ? "" : " ± " + a.distance_uncertainty_m.toFixed(3)}`;
    if (a.spots) return a.spots.map(s => this.readingWords(s)).join("\n");
    return this.readingWords(a.reading);
  }

  toldWords(request) {
    const o = (request.of || [request])[0].object || {}, told = { emissivity: v => "emissivity " + v, reflected_k: v => "reflected " + shownTemperature(v), distance_m: v => `distance ${v} m`, atmospheric_k: v => "air " + shownTemperature(v), relative_humidity: v => `humidity ${+(100 * v).toFixed(1)} %` };
    return Object.keys(told).filter(key => o[key] !== undefined).map(key => told[key](o[key])).join(", ");
  }

  show() {
    $("measurements").replaceChildren(...this.list.map((m, index) => {
      const item = element("div", undefined, "item measurement"), words = element("div", undefined, "words");
      words.append(element("strong", `${index + 1} ${m.name || m.answer.kind + ", not saved"}`));
      for (const line of this.words(m).split("\n")) words.append(element("div", line));
      if (this.toldWords(m.request)) words.append(element("small", this.toldWords(m.request)));
      for (const note of m.answer.notes || []) words.append(element("small", note));
      if (m.answer.profile) words.append(this.profile(m.answer.profile));
      for (const reading of [m.answer.reading, ...(m.answer.spots || []), ...(m.answer.of || []).map(part => part.reading)])
        if (reading && reading.frames && reading.frames.length) words.append(this.frames(reading));
      if (!m.name) {
        const label = element("input");
        label.placeholder = "name"; label.maxLength = 200; label.value = m.label; label.setAttribute("aria-label", `name of measurement ${index + 1}`);
        label.oninput = () => { m.label = label.value.trim(); this.drawMarks(); };
        words.append(label);
      }
      item.append(words);
      if (m.answer.kind !== "distance") item.append(button("Again", () => this.again(m)));
      item.append(m.name ? button("Remove", () => this.remove(m)) : button("Drop", () => { this.list.splice(index, 1); this.show(); }));
      return item;
    }));
    this.drawMarks();
  }

  profile(points) {
    const canvas = element("canvas"), known = points.filter(p => p.temperature_k !== undefined && p.temperature_k !== null);
    canvas.width = 320; canvas.height = 90; canvas.style.width = "100%";
    if (known.length < 2) return element("small", "too few places along it have a temperature");
    const low = Math.min(...known.map(p => p.temperature_k)), high = Math.max(low + 0.5, ...known.map(p => p.temperature_k)), end = points[points.length - 1].along || 1;
    const context = canvas.getContext("2d"), style = getComputedStyle(document.body);
    context.strokeStyle = context.fillStyle = style.color; context.lineWidth = 2; context.font = "12px system-ui, sans-serif";
    context.beginPath();
    let pen = false;
    for (const p of points) {
      if (p.temperature_k === undefined || p.temperature_k === null) { pen = false; continue; }
      const x = 4 + 312 * p.along / end, y = 74 - 58 * (p.temperature_k - low) / (high - low);
      if (pen) context.lineTo(x, y); else context.moveTo(x, y);
      pen = true;
    }
    context.stroke();
    context.fillText(shownTemperature(high), 4, 12); context.fillText(shownTemperature(low), 4, 88);
    return canvas;
  }

  /// Every mark as lists of points in the world with a number and a temperature.
  marks() {
    const marks = this.places.map(p => ({ points: [p], words: "" }));
    this.list.forEach((m, index) => {
      const a = m.answer, r = m.request, n = m.name || m.label || String(index + 1), at = reading => reading && reading.temperature_k !== null ? " " + shownTemperature(reading.temperature_k) : "";
      if (a.spots) a.spots.forEach(s => marks.push({ points: [s.point], words: n + at(s) }));
      else if (a.kind === "box") marks.push({ points: this.corners(r.box), box: true, words: n + at(a.reading) });
      else if (a.kind === "difference") marks.push({ points: r.of.map(o => o.places[0].point).filter(Boolean), words: n + " " + shownDifference(a.difference_k) });
      else if (a.kind === "spot") marks.push({ points: [a.point || (r.places[0] || {}).point].filter(Boolean), words: n + at(a.reading) });
      else marks.push({ points: (r.places || []).map(p => p.point).filter(Boolean), closed: a.kind === "polygon", words: n + at(a.reading) });
    });
    return marks.filter(m => m.points.length);
  }
  corners(box) {
    const [w, x, y, z] = box.rotation_wxyz || [1, 0, 0, 0], turn = new THREE.Quaternion(x, y, z, w), corners = [];
    for (let i = 0; i < 8; ++i) corners.push(new THREE.Vector3(...[1, 2, 4].map((bit, d) => (i & bit ? 0.5 : -0.5) * box.size[d])).applyQuaternion(turn).add(new THREE.Vector3(...box.center)).toArray());
    return corners;
  }
  /// On the stage; each mark as dots, strokes and words.
  drawn() {
    return this.marks().map(mark => {
      const dots = mark.points.map(p => this.surface.onScreen(new THREE.Vector3(...p))), strokes = [];
      if (mark.box) { for (let i = 0; i < 8; ++i) for (const bit of [1, 2, 4]) if (!(i & bit)) strokes.push([dots[i], dots[i | bit]]); }
      else if (mark.closed) dots.forEach((dot, i) => strokes.push([dot, dots[(i + 1) % dots.length]]));
      else if (dots.length > 1) strokes.push([dots[0], dots[dots.length - 1]]);
      return { dots: mark.box ? [] : dots.filter(Boolean), strokes: strokes.filter(([a, b]) => a && b), words: mark.words, at: dots.find(Boolean) };
    });
  }
  drawMarks() {
    const svg = $("marks"), make = (tag, attributes, words) => { const e = document.createElementNS(svg.namespaceURI, tag); for (const [k, v] of Object.entries(attributes)) e.setAttribute(k, v); if (words) e.textContent = words; return e; };
    svg.replaceChildren();
    for (const mark of this.drawn()) {
      for (const [a, b] of mark.strokes) for (const [stroke, w] of [["#000", 4], ["#fff", 2]]) svg.append(make("line", { x1: a.x, y1: a.y, x2: b.x, y2: b.y, stroke, "stroke-width": w }));
      for (const d of mark.dots) svg.append(make("circle", { cx: d.x, cy: d.y, r: 6, fill: "none", stroke: "#000", "stroke-width": 4 }), make("circle", { cx: d.x, cy: d.y, r: 6, fill: "none", stroke: "#fff", "stroke-width": 2 }));
      if (mark.at && mark.words) svg.append(make("text", { x: mark.at.x + 10, y: mark.at.y - 8 }, mark.words));
    }
  }
  drawOn(context, width, height) {
    const sx = width / this.surface.width, sy = height / this.surface.height;
    context.font = "600 13px system-ui, sans-serif"; context.textBaseline = "alphabetic";
    for (const mark of this.drawn()) for (const [colour, w] of [["#000", 3], ["#fff", 1.5]]) {
      context.strokeStyle = colour; context.lineWidth = w;
      for (const [a, b] of mark.strokes) { context.beginPath(); context.moveTo(a.x * sx, a.y * sy); context.lineTo(b.x * sx, b.y * sy); context.stroke(); }
      for (const d of mark.dots) { context.beginPath(); context.arc(d.x * sx, d.y * sy, 5, 0, 7); context.stroke(); }
      if (mark.at) { if (colour === "#000") context.strokeText(mark.words, mark.at.x * sx + 8, mark.at.y * sy - 6); else { context.fillStyle = colour; context.fillText(mark.words, mark.at.x * sx + 8, mark.at.y * sy - 6); } }
    }
  }
}
