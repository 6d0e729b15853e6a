// SPDX-License-Identifier: BSD-3-Clause
"use strict";
// Temperatures to colours, on this side: palette, span and isotherm change without a question.
const palettes = {};  // name -> Uint8Array of 256 R, G, B
const show = { palette: "inferno", low: 273, high: 300, auto: false, isotherm: "off", isoLow: 0, isoHigh: 0, opacity: 0.6 };
const isothermColour = [25, 227, 200];

function bytesOf(hex) { return Uint8Array.from({ length: hex.length / 2 }, (_, i) => parseInt(hex.substr(2 * i, 2), 16)); }
function readPalettes(hex) { for (const [name, text] of Object.entries(hex)) palettes[name] = bytesOf(text); }
/// The scale of a layer's colours: the fused picture has the run's own, whatever is chosen for the others.
function scaleOf(layer) {
  const heat = viewer.scene.heat;
  if (layer === "fused") return { low: heat.usual, high: heat.hot, colours: viewer.heatColours, strengths: viewer.heatStrengths, bar: viewer.heatRamp, marks: false };
  return layer === "visible" || !layer ? null : { low: show.low, high: show.high, colours: palettes[show.palette], marks: true };
}
/// Of the first layer on the stage that shows temperatures; null where none does.
const shownScale = () => viewer.scene.thermal ? scaleOf(viewer.rest.layer) || scaleOf(viewer.rest.other) : null;
const levelOf = (part, count) => count ? part.scale * count + part.offset : NaN;
const meetsIsotherm = k => show.isotherm === "above" ? k >= show.isoLow : show.isotherm === "below" ? k <= show.isoHigh
  : show.isotherm === "between" ? k >= show.isoLow && k <= show.isoHigh : false;

/// The counts as colours on a canvas of their size. overlay: what doesn't meet the isotherm stays clear.
function paintThermal(part, canvas, overlay) {
  canvas.width = part.width; canvas.height = part.height;
  const context = canvas.getContext("2d"), image = context.createImageData(part.width, part.height), out = image.data;
  const table = new Uint32Array(65536), bytes = new Uint8Array(table.buffer), colours = palettes[show.palette];
  const width = Math.max(1e-6, show.high - show.low), marking = show.isotherm !== "off";
  let least = 65535, most = 1;
  for (const c of part.counts) if (c) { if (c < least) least = c; if (c > most) most = c; }
  for (let c = least; c <= most; ++c) {
    const k = levelOf(part, c), i = 3 * Math.round(255 * Math.min(1, Math.max(0, (k - show.low) / width))), met = meetsIsotherm(k);
    let colour = [colours[i], colours[i + 1], colours[i + 2], 255];
    if (marking && met && !overlay) colour = [...isothermColour, 255];
    if (marking && !met && overlay) colour = [0, 0, 0, 0];
    bytes.set(colour, 4 * c);
  }
  const pixels = new Uint32Array(out.buffer), counts = part.counts;
  for (let i = 0; i < counts.length; ++i) pixels[i] = table[counts[i]];
  context.putImageData(image, 0, 0);
  return canvas;
}

/// Half a per cent of the picture is colder, a hundredth of one hotter, as the run's own span.
function spanOf(part) {
  const histogram = new Uint32Array(65536);
  let total = 0;
  for (const c of part.counts) if (c) { ++histogram[c]; ++total; }
  if (!total) return null;
  const at = share => { let sum = 0; for (let c = 1; c < 65536; ++c) { sum += histogram[c]; if (sum >= share * total) return levelOf(part, c); } return levelOf(part, 65535); };
  const low = at(0.005), high = at(0.9999);
  return high - low < 0.5 ? { low: (low + high) / 2 - 0.25, high: (low + high) / 2 + 0.25 } : { low, high };
}

function temperatureAt(part, u, v) {
  const x = Math.min(part.width - 1, Math.max(0, Math.floor(u * part.width))), y = Math.min(part.height - 1, Math.max(0, Math.floor(v * part.height)));
  return levelOf(part, part.counts[y * part.width + x]);
}

function drawLegend() {
  const scale = shownScale();
  $("legend").hidden = !scale;
  if (!scale) return;
  const context = $("bar").getContext("2d"), image = context.createImageData(256, 1), { low, high, marks } = scale;
  const colours = scale.bar || scale.colours;  // as they lie over the picture
  for (let i = 0; i < 256; ++i) {
    const k = low + (high - low) * i / 255;
    image.data.set(marks && meetsIsotherm(k) ? [...isothermColour, 255] : [colours[3 * i], colours[3 * i + 1], colours[3 * i + 2], 255], 4 * i);
  }
  context.putImageData(image, 0, 0);
  // Two scales may be on the stage: which of them the bar is.
  const of = viewer.rest.other && scaleOf(viewer.rest.other) && scaleOf(viewer.rest.layer) ? { fused: "Heat ", thermal: "Thermal ", mix: "Overlay " }[viewer.rest.layer] : "";
  $("bar-low").textContent = of + shownTemperature(low); $("bar-high").textContent = shownTemperature(high);
}
