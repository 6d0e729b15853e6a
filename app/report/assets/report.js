"use strict";
// The page is complete without this script (first view, all tables); it adds choosing a view, the
// swipe and the temperature under the pointer.
(() => {
  const views = JSON.parse(document.getElementById("views").textContent);
  const byId = (id) => document.getElementById(id);
  if (!views.length || !byId("viewer")) return;
  let view = views[0];

  const images = () => {
    const list = [];
    if (view.visible) list.push(["Visible", view.visible]);
    if (view.thermal) list.push(["Infrared", view.thermal]);
    for (const f of view.fused) list.push(["Fused, " + f.method, f.uri]);
    return list;
  };
  const fill = (select, wanted) => {
    select.replaceChildren(...images().map(([label], i) => new Option(label, i)));
    select.value = Math.min(wanted, images().length - 1);
  };
  const left = byId("left"), right = byId("right"), method = byId("method"), cut = byId("cut");

  const showSwipe = () => {
    if (!left) return;
    const [a, b] = [images()[left.value], images()[right.value]];
    byId("swipe-left").src = a[1]; byId("swipe-left").alt = a[0] + ", " + view.name;
    byId("swipe-right").src = b[1]; byId("swipe-right").alt = b[0] + ", " + view.name;
    byId("tag-left").textContent = a[0]; byId("tag-right").textContent = b[0];
  };
  const show = () => {
    for (const kind of ["visible", "thermal"]) {
      const img = byId("img-" + kind);
      if (img && view[kind]) { img.src = view[kind]; img.alt = img.dataset.label + ", " + view.name; }
    }
    const fused = byId("img-fused");
    if (fused && method) {
      const f = view.fused[method.value] || view.fused[0];
      fused.src = f.uri; fused.alt = "Fused with " + f.method + ", " + view.name;
    }
    document.querySelectorAll(".strip button").forEach((b, i) =>
      b.setAttribute("aria-pressed", String(views[i] === view)));
    showSwipe();
  };
  document.querySelectorAll(".strip button").forEach((b, i) =>
    b.addEventListener("click", () => { view = views[i]; grid = decode(); show(); }));

  if (method) {
    method.replaceChildren(...view.fused.map((f, i) => new Option(f.method, i)));
    method.value = 0;  // the default method comes first
    method.addEventListener("change", show);
  }
  if (left) {
    fill(left, 0);
    fill(right, (view.visible ? 1 : 0) + (view.thermal ? 1 : 0));  // the first fused image
    for (const s of [left, right]) s.addEventListener("change", showSwipe);
    const swipe = byId("swipe");
    const move = (percent) => { cut.value = percent; swipe.style.setProperty("--cut", percent + "%"); };
    cut.addEventListener("input", () => move(cut.value));
    const drag = (e) => {
      const box = swipe.getBoundingClientRect();
      move(Math.max(0, Math.min(100, 100 * (e.clientX - box.left) / box.width)));
    };
    swipe.addEventListener("pointerdown", (e) => { swipe.setPointerCapture(e.pointerId); drag(e); });
    swipe.addEventListener("pointermove", (e) => { if (e.buttons) drag(e); });
  }

  // Temperatures ride along as a small grid of 16-bit counts.
  const decode = () => {
    if (!view.temperature) return null;
    const raw = Uint8Array.from(atob(view.temperature.counts), (c) => c.charCodeAt(0));
    return new DataView(raw.buffer);
  };
  let grid = decode();
  document.querySelectorAll(".probe").forEach((box) => {
    const out = box.querySelector(".readout");
    box.addEventListener("pointermove", (e) => {
      const r = box.querySelector("img").getBoundingClientRect(), t = view.temperature;
      if (!grid) return;
      const x = Math.floor((e.clientX - r.left) / r.width * t.width);
      const y = Math.floor((e.clientY - r.top) / r.height * t.height);
      if (x < 0 || y < 0 || x >= t.width || y >= t.height) { out.textContent = ""; return; }
      const count = grid.getUint16(2 * (y * t.width + x), true);
      out.textContent = count ? (count * t.kelvin_per_count - 273.15).toFixed(1) + " °C" : "no value";
    });
    box.addEventListener("pointerleave", () => { out.textContent = ""; });
  });
  show();
})();
