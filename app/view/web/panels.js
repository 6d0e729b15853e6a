// SPDX-License-Identifier: BSD-3-Clause
"use strict";
// The tools beside the picture.
function choices(box, list, chosen, onChoose) {
  box.replaceChildren(...list.map(([value, words]) => {
    const button = document.createElement("button");
    button.type = "button"; button.textContent = words; button.dataset.value = value;
    button.setAttribute("role", "radio"); button.setAttribute("aria-checked", value === chosen);
    button.onclick = () => { mark(value); onChoose(value); };
    return button;
  }));
  const mark = value => { for (const b of box.children) b.setAttribute("aria-checked", b.dataset.value === value); };
  return mark;
}
function options(select, list, chosen) {
  select.replaceChildren(...list.map(([value, words]) => new Option(words, value, false, value === chosen)));
}
function download(blob, name) {
  const link = document.createElement("a");
  link.href = URL.createObjectURL(blob); link.download = name; link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 10000);
}
function element(tag, words, className) { const e = document.createElement(tag); if (words !== undefined) e.textContent = words; if (className) e.className = className; return e; }
function button(words, onclick) { const b = element("button", words); b.type = "button"; b.onclick = onclick; return b; }

/// Boxes for temperatures that are read in the unit that is shown, whenever something is measured.
const typedTemperatures = ["reflected", "air", "recorded-reflected"];
function chooseUnit(chosen) {
  const typed = typedTemperatures.map(id => [$(id), $(id).value.trim()]).filter(([, text]) => text && Number.isFinite(Number(text)))
    .map(([box, text]) => [box, toKelvin(Number(text))]);
  unit = chosen;
  // Three decimals, so that a unit and back gives what was typed.
  for (const [box, kelvin] of typed) box.value = +fromKelvin(kelvin).toFixed(3);
  localStorage.setItem("unit", unit);
}

/// Palette, span, unit and isotherm; onChange when colours are to be drawn anew.
function temperaturePanel(scene, onChange) {
  options($("palette"), Object.keys(palettes).map(p => [p, p]), show.palette);
  const fill = () => {
    for (const [id, k] of [["low", show.low], ["high", show.high], ["iso-low", show.isoLow], ["iso-high", show.isoHigh]])
      if (document.activeElement !== $(id)) $(id).value = fromKelvin(k).toFixed(1);
    $("iso-low-label").hidden = !["above", "between"].includes(show.isotherm);
    $("iso-high-label").hidden = !["below", "between"].includes(show.isotherm);
    // What none of the layers on the stage follows is not to be set.
    const followed = [viewer.rest.layer, viewer.rest.other].some(layer => layer === "thermal" || layer === "mix");
    $("palette").disabled = $("auto-span").disabled = $("run-span").disabled = !followed;
    $("low").disabled = $("high").disabled = show.auto || !followed;
    for (const words of document.querySelectorAll(".unit")) words.textContent = unitWords().trim();
    drawLegend();
  };
  const changed = () => { fill(); onChange(); };
  $("palette").onchange = () => { show.palette = $("palette").value; changed(); };
  $("unit").onchange = () => { chooseUnit($("unit").value); changed(); };
  $("unit").disabled = gray;
  $("auto-span").onchange = () => { show.auto = $("auto-span").checked; changed(); };
  $("run-span").onclick = () => { show.auto = $("auto-span").checked = false; [show.low, show.high] = scene.span; changed(); };
  for (const [id, key] of [["low", "low"], ["high", "high"], ["iso-low", "isoLow"], ["iso-high", "isoHigh"]])
    $(id).oninput = () => {
      const value = parseFloat($(id).value);
      if (!Number.isFinite(value)) return;
      show[key] = toKelvin(value);
      changed();
    };
  $("isotherm").onchange = () => { show.isotherm = $("isotherm").value; changed(); };
  $("opacity").oninput = () => { show.opacity = +$("opacity").value; onChange(); };
  show.isoLow = scene.span[0] + 0.75 * (scene.span[1] - scene.span[0]); show.isoHigh = scene.span[1];
  fill();
  return fill;
}

/// The photo of a recorded camera beside the render from its pose.
class PhotoDialog {
  constructor(scene, surface) {
    this.facts = scene; this.surface = surface; this.box = $("photo");
    $("photo-close").onclick = () => this.box.close();
    $("photo-previous").onclick = () => this.step(-1);
    $("photo-next").onclick = () => this.step(1);
    $("photo-go").onclick = () => { this.box.close(); surface.standAt(scene.views[this.index]); };
    this.box.onclose = () => { if (this.asking) this.asking.abort(); };
  }
  step(by) {
    const views = this.facts.views, modality = views[this.index].modality;
    let i = this.index;
    do i = (i + by + views.length) % views.length; while (views[i].modality !== modality);
    this.open(i);
  }
  async open(index) {
    this.index = index;
    const view = this.facts.views[index];
    $("photo-name").textContent = view.name;
    $("photo-doubt").textContent = view.doubt ? "In doubt: " + view.doubt : ""; $("photo-doubt").className = "warning";
    if (!this.box.open) this.box.showModal();
    if (this.asking) this.asking.abort();
    const signal = (this.asking = new AbortController()).signal;
    this.shown = {};
    for (const id of ["photo-recorded", "photo-rendered"]) { $(id).width = view.width; $(id).height = view.height; }
    $("photo-rendered-words").textContent = "rendering from its pose";
    ask("/photo/" + index, undefined, signal).then(a => a.arrayBuffer()).then(pictureParts).then(p => { this.shown.recorded = p; this.paint(); })
      .catch(error => { if (!signal.aborted) $("photo-doubt").textContent = error.message; });
    try {
      for (const width of [160, Math.min(640, view.width)]) {
        this.shown.rendered = await pictureParts(await (await ask("/render", { client: clientName + "p", view: index, width, layers: [view.modality] }, signal)).arrayBuffer());
        this.paint();
      }
      $("photo-rendered-words").textContent = "rendered from its pose";
    } catch (error) { if (!signal.aborted) $("photo-rendered-words").textContent = error.message; }
  }
  paint() {
    for (const key of ["recorded", "rendered"]) {
      const picture = this.shown && this.shown[key] && this.shown[key][this.facts.views[this.index].modality];
      if (!picture) continue;
      const canvas = $("photo-" + key);
      if (picture.counts) paintThermal(picture, canvas, false);
      else { canvas.width = picture.width; canvas.height = picture.height; canvas.getContext("2d").drawImage(picture.image, 0, 0); }
    }
  }
}

function cameraPanel(scene, surface, photo) {
  for (const modality of ["visible", "thermal"]) {
    const box = $("show-" + modality), any = scene.views.some(v => v.modality === modality);
    box.parentElement.hidden = !any;
    box.onchange = () => { surface.frusta[modality].visible = box.checked; surface.draw(); };
  }
  $("reset").onclick = () => surface.reset();
  const doubtful = scene.views.map((v, i) => [v, i]).filter(([v]) => v.doubt);
  $("camera-words").textContent = scene.views.length + " recorded views; touch one to see its photo" + (doubtful.length ? `. ${doubtful.length} in doubt, crossed out in yellow:` : ".");
  $("doubtful").replaceChildren(...doubtful.map(([view, index]) => {
    const item = element("div", undefined, "item"), words = element("div", view.name, "words");
    words.append(element("small", view.doubt)); item.append(words, button("Photo", () => photo.open(index)));
    return item;
  }));
}
