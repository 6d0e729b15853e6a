// SPDX-License-Identifier: BSD-3-Clause
"use strict";
// While the camera rests: both fields as seen from there, coarse first, each finer picture in the place of the last.
class RestingView {
  constructor(canvas, surface, scene) {
    this.canvas = canvas; this.surface = surface; this.facts = scene;
    this.layer = "visible"; this.other = null; this.divider = 0.5;
    this.pictures = {}; this.asking = null; this.timer = 0;
    this.thermal = document.createElement("canvas"); this.coloured = document.createElement("canvas"); this.overlay = document.createElement("canvas");
    this.onChange = () => {};
  }

  /// The camera moves: the surface stands in, and what is being rendered is of no use. last: nothing more comes of this movement.
  moved(last) {
    this.canvas.classList.remove("shown");
    this.surface.moves(); this.surface.behindPicture(false);
    this.drop();
    this.pictures = {}; this.level = -1;
    clearTimeout(this.timer); clearTimeout(this.late);
    // At 30 pictures a second the next move comes sooner than that.
    this.timer = setTimeout(() => this.render(), 40);
    if (last) this.released();
    this.onChange();
  }

  /// What moved the camera has let go of it.
  released() { if (this.timer) this.render(); }

  drop() { if (this.asking) this.asking.abort(); this.asking = null; }

  wanted() {
    const layers = new Set(this.facts.thermal ? ["thermal"] : []);
    for (const layer of [this.layer, this.other]) {
      if (layer === "mix") layers.add("visible");
      else if (layer) layers.add(layer);
    }
    return [...layers];
  }

  /// Sizes keep the stage's shape; the last has about as many pixels as 640 x 480.
  size(share) {
    const { width, height } = this.surface, s = Math.min(1, Math.sqrt(307200 / (width * height))) * share;
    return [Math.max(16, Math.round(width * s)), Math.max(16, Math.round(height * s))];
  }

  steps(layers) {
    // Coarse temperatures, which are there by then, come with the full picture; their own detail a step later.
    const two = layers.some(l => l !== "thermal") && layers.includes("thermal");
    const steps = [[8, 8], [5, 5], ...(two ? [[1, 5]] : []), [1, 1]].map(([divisor, thermal_divisor]) => ({ divisor, thermal_divisor }));
    return this.facts.detail ? [...steps, { divisor: 1, thermal_divisor: 1, detail: true }] : steps;
  }

  /// The surface in full, once nothing is waited for: till then its drawing would take the renderer's time.
  settled() { this.surface.moving = false; this.surface.draw(); }

  async render() {
    this.drop();
    clearTimeout(this.timer); this.timer = 0;
    this.finished = false;
    const asking = this.asking = new AbortController(), layers = this.wanted();
    if (!layers.length) return this.settled();
    const steps = this.steps(layers), [width, height] = this.size(1);
    const askFor = step => {
      const answer = ask("/render", { client: clientName, ...this.surface.shot(width, height), layers, ...step }, asking.signal);
      answer.catch(() => {});  // told where it is awaited
      return answer;
    };
    let next = askFor(steps[0]);
    clearTimeout(this.late);
    this.late = setTimeout(() => this.settled(), 400);
    for (let i = 0; i < steps.length; ++i) {
      try {
        const answer = await next, bytes = await answer.arrayBuffer();
        // The next is rendered while this one is unpacked and shown.
        if (i + 1 < steps.length) next = askFor(steps[i + 1]);
        const pictures = await pictureParts(bytes);
        if (asking.signal.aborted) return;
        clearTimeout(this.late);
        this.pictures = pictures; this.level = i; this.finished = i + 1 === steps.length;
        this.width = Math.round(width / steps[i].divisor); this.height = Math.round(height / steps[i].divisor);
        $("hint").textContent = "";
        this.paint();
      } catch (error) {
        if (asking.signal.aborted || error.name === "AbortError") return;
        if (error.status === 503) {
          await new Promise(done => setTimeout(done, 500));
          if (asking.signal.aborted) return;
          next = askFor(steps[i--]);
          continue;
        }
        if (error.status !== 409) $("hint").textContent = error.status ? error.message : "no answer from the viewer: is it still running?";
        if (steps[i].detail) this.finished = true;  // without it
        this.settled(); this.onChange();
        return;
      }
    }
    this.asking = null;
    this.settled();
    this.onChange();
  }

  /// A layer was chosen: what is there is shown, what is missing is asked for.
  choose(layer, other) {
    this.layer = layer; this.other = other;
    if (this.level === undefined || this.level < 0) return;
    if (this.wanted().every(l => this.pictures[l])) this.paint();
    else this.render();
  }

  paint() {
    const thermal = this.pictures.thermal;
    if (thermal && show.auto) {
      const span = spanOf(thermal);
      if (span) { show.low = span.low; show.high = span.high; }
    }
    this.canvas.width = this.width; this.canvas.height = this.height;
    this.drawn = {};
    this.put(this.layer, 0, this.other ? this.divider : 1);
    if (this.other) this.put(this.other, this.divider, 1);
    this.canvas.classList.add("shown");
    this.surface.behindPicture(true);
    this.onChange();
  }

  /// A layer on the part of the width from one share to another.
  put(layer, from, to) {
    const context = this.canvas.getContext("2d"), { width, height } = this, { visible, thermal, fused } = this.pictures;
    context.save();
    context.beginPath(); context.rect(from * width, 0, (to - from) * width, height); context.clip();
    const image = { visible, fused, mix: visible }[layer];
    if (image) context.drawImage(image.image, 0, 0, width, height);
    if (thermal && layer === "thermal") {
      context.fillStyle = "#222"; context.fillRect(0, 0, width, height);
      context.drawImage(this.painted("thermal", this.coloured, false), 0, 0, width, height);
    }
    if (thermal && layer === "mix") {
      context.globalAlpha = show.opacity;
      context.drawImage(this.painted("mix", this.overlay, true), 0, 0, width, height);
    }
    context.restore();
  }

  painted(key, canvas, overlay) {
    if (!this.drawn[key]) this.drawn[key] = paintThermal(this.pictures.thermal, canvas, overlay);
    return this.drawn[key];
  }

  /// Kelvin at a place of the stage given as shares; nothing while the camera moves.
  temperature(u, v) { return this.level >= 0 && this.pictures.thermal ? temperatureAt(this.pictures.thermal, u, v) : null; }
}
