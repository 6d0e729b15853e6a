// SPDX-License-Identifier: BSD-3-Clause
"use strict";
// The page's ways of asking the server and of writing temperatures.
const $ = id => document.getElementById(id);
const token = new URLSearchParams(location.search).get("token") || "";
const clientName = Array.from(crypto.getRandomValues(new Uint8Array(12)), b => b.toString(16).padStart(2, "0")).join("");
const headers = { "X-OrbitFuse": "1", "X-Token": token };

/// An answer, or an error in the server's own words.
async function ask(path, body, signal) {
  const answer = await fetch(path, body === undefined ? { headers, signal, cache: "no-store" }
    : { method: "POST", headers: { ...headers, "Content-Type": "application/json" }, body: JSON.stringify(body), signal, cache: "no-store" });
  if (answer.ok) return answer;
  const error = new Error((await answer.text()).trim() || "the viewer answered " + answer.status);
  error.status = answer.status;
  throw error;
}

let unit = "C", gray = false;
const unitWords = () => gray ? "" : { C: " °C", F: " °F", K: " K" }[unit];
const fromKelvin = k => gray || unit === "K" ? k : unit === "C" ? k - 273.15 : (k - 273.15) * 1.8 + 32;
const toKelvin = v => gray || unit === "K" ? v : unit === "C" ? v + 273.15 : (v - 32) / 1.8 + 273.15;
const shownTemperature = (k, digits = 1) => Number.isFinite(k) ? fromKelvin(k).toFixed(digits) + unitWords() : "–";
/// A difference has no zero.
const shownDifference = (k, digits = 1) => Number.isFinite(k) ? (gray ? k : unit === "F" ? k * 1.8 : k).toFixed(digits) + (gray ? "" : unit === "F" ? " °F" : " K") : "–";

/// Several pictures in one answer: app/view/picture_parts.hpp.
async function pictureParts(bytes) {
  const length = new DataView(bytes).getUint32(0, true);
  const head = JSON.parse(new TextDecoder().decode(new Uint8Array(bytes, 4, length)));
  const pictures = {};
  let at = 4 + length;
  for (const part of head.parts) {
    if (part.encoding === "jpeg") {
      part.image = await createImageBitmap(new Blob([new Uint8Array(bytes, at, part.bytes)], { type: "image/jpeg" }));
    } else {
      part.counts = new Uint16Array(bytes.slice(at, at + part.bytes));
    }
    at += part.bytes;
    pictures[part.name] = part;
  }
  return pictures;
}
