// SPDX-License-Identifier: BSD-3-Clause
"use strict";
const viewer = {};

async function begin() {
  const scene = await (await ask("/scene")).json();
  viewer.scene = scene; gray = scene.gray;
  document.title = scene.name.split("/").pop() + " · OrbitFuse view";
  readPalettes(scene.palettes); viewer.heatColours = bytesOf(scene.heat.colors); viewer.heatStrengths = bytesOf(scene.heat.strengths); viewer.heatRamp = bytesOf(scene.heat.ramp); show.palette = scene.palette; [show.low, show.high] = scene.span;
  if (localStorage.getItem("unit")) $("unit").value = unit = localStorage.getItem("unit");
  $("run-words").textContent = [scene.name, `${scene.surface.points} surface points`, ...scene.notes].join(" · ");

  const surface = viewer.surface = new Surface($("surface"), scene);
  const rest = viewer.rest = new RestingView($("rest"), surface, scene);
  const photo = viewer.photo = new PhotoDialog(scene, surface);
  const layers = [["visible", "Visible"], ["thermal", "Thermal"], ["fused", "Heat"], ["mix", "Overlay"]]
    .filter(([l]) => l === "visible" ? scene.visible : l === "thermal" ? scene.thermal : scene.visible && scene.thermal);
  let layer = scene.visible && scene.thermal ? "fused" : layers[0][0];
  const both = () => $("compare").getAttribute("aria-pressed") === "true" ? $("other").value : null;
  const chosen = () => { surface.style(layer); rest.choose(layer, both()); rest.layer = layer; rest.other = both(); fillSpan(); placeDivider(); };
  choices($("layers"), layers, layer, value => { layer = value; chosen(); });
  options($("other"), layers, scene.thermal ? "thermal" : layer);
  $("other").onchange = chosen;
  $("compare").hidden = layers.length < 2;
  $("compare").onclick = () => {
    const on = $("compare").getAttribute("aria-pressed") !== "true";
    $("compare").setAttribute("aria-pressed", on); $("compare-with").hidden = $("swipe").hidden = !on;
    if (on && $("other").value === layer) $("other").value = layers.find(([l]) => l !== layer)[0];
    chosen();
  };
  const fillSpan = temperaturePanel(scene, () => { surface.style(layer); if (rest.level >= 0) rest.paint(); photo.paint(); showReadout(); });
  cameraPanel(scene, surface, photo);
  surface.onMove = last => rest.moved(last);
  for (const end of ["pointerup", "touchend"]) $("surface").addEventListener(end, () => rest.released());
  rest.onChange = () => {
    $("progress").textContent = rest.level >= 0 && !rest.finished ? `${rest.width} × ${rest.height}` : "";
    if (show.auto) { fillSpan(); surface.style(layer); }
    showReadout();
    for (const listener of viewer.onPicture) listener();
  };
  viewer.onPicture = [];
  rest.layer = layer;
  fillSpan();
  surface.style(layer);
  dividerByHand(rest);
  pointer(surface, photo);
  const fit = () => { surface.resize($("stage").clientWidth, $("stage").clientHeight); placeDivider(); rest.moved(); };
  new ResizeObserver(fit).observe($("stage"));
  $("menu").onclick = () => { const open = $("panel").hidden; $("panel").hidden = !open; $("menu").setAttribute("aria-expanded", open); };
  surface.addFrusta();
  viewer.measuring = new Measuring(scene, surface, rest);
  keepingPanel(scene, surface, rest, () => layer);
  if (scene.surface.points) surface.addPoints(await (await ask("/surface")).arrayBuffer());
  await showMesh(surface);
}

/// In the points' place, once it is made.
async function showMesh(surface) {
  const say = (words, bad) => { $("surface-words").textContent = words; $("surface-words").className = bad ? "warning" : ""; };
  try {
    let answer = await ask("/mesh");
    while (answer.status === 202) {
      say("The surface is being made; points stand in for it.");
      await new Promise(done => setTimeout(done, 1000));
      answer = await ask("/mesh");
    }
    surface.addMesh(await answer.arrayBuffer());
    say("");
  } catch (error) {
    say("Points stand in for the surface: " + error.message, true);
    $("hint").textContent = $("surface-words").textContent;
  }
}

function placeDivider() { $("swipe").style.left = 100 * viewer.rest.divider + "%"; }
function dividerByHand(rest) {
  const line = $("swipe"), to = share => { rest.divider = Math.min(0.98, Math.max(0.02, share)); placeDivider(); if (rest.level >= 0) rest.paint(); };
  line.onpointerdown = e => { line.setPointerCapture(e.pointerId); e.preventDefault(); };
  line.onpointermove = e => { if (line.hasPointerCapture(e.pointerId)) to(e.clientX / $("stage").clientWidth); };
  line.onkeydown = e => { const by = { ArrowLeft: -0.02, ArrowRight: 0.02 }[e.key]; if (by) to(rest.divider + by); };
}

/// The temperature under the pointer; a touch or click that doesn't move chooses what is there.
let pointed = null;
function showReadout() {
  const k = pointed && viewer.rest.temperature(pointed.u, pointed.v);
  $("readout").textContent = k === null || k === undefined ? "" : Number.isFinite(k) ? shownTemperature(k) : "not measured";
}
function pointer(surface, photo) {
  const canvas = $("surface");
  let pressed = null;
  const place = e => { const box = canvas.getBoundingClientRect(); pointed = { u: (e.clientX - box.left) / box.width, v: (e.clientY - box.top) / box.height, x: e.clientX - box.left, y: e.clientY - box.top }; showReadout(); };
  canvas.addEventListener("pointermove", place);
  canvas.addEventListener("pointerleave", e => { if (e.pointerType === "mouse") { pointed = null; showReadout(); } });
  canvas.addEventListener("pointerdown", e => { pressed = { x: e.clientX, y: e.clientY }; place(e); });
  canvas.addEventListener("pointerup", e => {
    if (!pressed || Math.hypot(e.clientX - pressed.x, e.clientY - pressed.y) > 6) return;
    place(e);
    if (viewer.onPlace && viewer.onPlace(pointed)) return;
    const index = surface.cameraAt(pointed.x, pointed.y);
    if (index !== null) photo.open(index);
  });
}
