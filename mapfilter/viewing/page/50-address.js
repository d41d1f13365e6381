"use strict";
// The part of the address after #: the moment, the run and the place, so that a link opens there.
(() => {
  MF.readAddress = (page) => {
    const given = new URLSearchParams(window.location.hash.slice(1));
    const change = {};
    const t = Number(given.get("t"));
    if (given.has("t") && Number.isFinite(t)) change.time = MF.clamp(t, page.start, page.end);
    const run = Number(given.get("run"));
    if (given.has("run") && page.runs[run]) change.run = run;
    const at = (given.get("at") ?? "").split(",").map(Number);
    if (at.length === 2 && at.every(Number.isFinite)) {
      change.place = { east: at[0], north: at[1] };
      change.against = "place";
    }
    return change;
  };

  MF.addressOf = (page) => {
    const { time, run, place } = page.store.state;
    const parts = page.runs.length ? [`t=${time}`] : [];
    if (run) parts.push(`run=${run}`);
    if (place) parts.push(`at=${place.east.toFixed(1)},${place.north.toFixed(1)}`);
    return `#${parts.join("&")}`;
  };

  MF.writeAddress = (page) => {
    const hash = MF.addressOf(page);
    if (hash === window.location.hash) return;
    try {
      window.history.replaceState(null, "", hash);
    } catch {
      // A page in a notebook's frame may not change its address.
    }
  };
})();
