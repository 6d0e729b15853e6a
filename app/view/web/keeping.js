// SPDX-License-Identifier: BSD-3-Clause
"use strict";
// Pictures to take away and views to come back to.
function keepingPanel(scene, surface, rest) {
  const base = scene.name.split("/").pop() || "view";
  const say = (id, words, bad) => { $(id).textContent = words; $(id).className = bad ? "warning" : ""; };
  const saying = id => error => say(id, error.message, true);

  $("save-png").onclick = () => {
    // What is on the stage, at the picture's own size, with what it stands for below.
    const source = rest.level >= 0 ? rest.canvas : surface.renderer.domElement, strip = shownScale() ? 44 : 0;
    const picture = document.createElement("canvas"), context = picture.getContext("2d");
    picture.width = source.width; picture.height = source.height + strip;
    context.fillStyle = "#14161a"; context.fillRect(0, 0, picture.width, picture.height);
    context.drawImage(source, 0, 0);
    if (viewer.drawMarks) viewer.drawMarks(context, source.width, source.height);
    if (strip) {
      context.imageSmoothingEnabled = false;
      context.drawImage($("bar"), 8, source.height + 6, picture.width - 16, 14);
      context.fillStyle = "#fff"; context.font = "14px system-ui, sans-serif"; context.textBaseline = "top";
      context.fillText($("bar-low").textContent, 8, source.height + 24);
      const high = $("bar-high").textContent;
      context.fillText(high, picture.width - 8 - context.measureText(high).width, source.height + 24);
    }
    picture.toBlob(blob => download(blob, base + ".png"), "image/png");
  };
  $("save-tiff").hidden = !scene.thermal || scene.gray;
  $("save-tiff").onclick = async () => {
    const [width, height] = rest.size(1);
    try {
      const answer = await ask("/temperatures.tiff", { client: clientName + "t", ...surface.shot(width, height) });
      download(await answer.blob(), base + ".tiff");
      say("film-words", "");
    } catch (error) { saying("film-words")(error); }
  };

  const showBookmarks = list => {
    viewer.bookmarks = list;
    $("bookmarks").replaceChildren(...list.map(view => {
      const item = element("div", undefined, "item");
      item.append(button(view.name, () => surface.stand(view)), element("span", undefined, "gap"),
        button("Remove", () => ask("/bookmarks/remove", { name: view.name }).then(a => a.json()).then(showBookmarks).catch(saying("film-words"))));
      return item;
    }));
    $("film").disabled = list.length < 2;
    if (!$("bookmark-name").value || /^view \d+$/.test($("bookmark-name").value)) $("bookmark-name").value = freeName(list);
  };
  const freeName = list => { for (let n = list.length + 1; ; ++n) if (!list.some(v => v.name === "view " + n)) return "view " + n; };
  $("bookmark").onclick = () => ask("/bookmarks/add", { name: $("bookmark-name").value.trim() || freeName(viewer.bookmarks || []), ...surface.pose() })
    .then(a => a.json()).then(list => { $("bookmark-name").value = ""; showBookmarks(list); say("film-words", ""); }).catch(saying("film-words"));
  const showFilm = state => {
    $("film").hidden = state.making; $("film-stop").hidden = $("film-progress").hidden = !state.making;
    $("film-progress").max = Math.max(1, state.total); $("film-progress").value = state.done;
    if (state.making) say("film-words", `${state.done} of ${state.total} pictures`);
    else if (state.error) say("film-words", state.error, state.error !== "stopped");
    else if (state.file) say("film-words", "made: " + state.file);
    if (state.making) setTimeout(() => ask("/film").then(a => a.json()).then(showFilm).catch(saying("film-words")), 500);
  };
  /// The server renders films, and the overlay is laid over in the browser.
  const filmLayer = () => rest.layer === "mix" ? "fused" : rest.layer;
  const sayFilmLayer = () => { $("film-layer").hidden = filmLayer() === rest.layer; };
  viewer.onPicture.push(sayFilmLayer);
  $("film").onclick = () => {
    const layer = filmLayer(), [width, height] = rest.size(1);
    ask("/film", { kind: $("film-kind").value, layer, palette: show.palette, span: [show.low, show.high], width, height })
      .then(a => a.json()).then(showFilm).catch(saying("film-words"));
  };
  $("film-stop").onclick = () => ask("/film/stop", {}).then(a => a.json()).then(showFilm).catch(saying("film-words"));
  ask("/film").then(a => a.json()).then(state => { if (state.making) showFilm(state); }).catch(() => {});
  ask("/bookmarks").then(a => a.json()).then(showBookmarks).catch(saying("film-words"));
}
begin().catch(error => { $("hint").textContent = error.message; });
