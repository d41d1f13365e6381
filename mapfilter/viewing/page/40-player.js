"use strict";
// Playback: the transport with its slider and strip of statuses, keys, and the clock that drives time.
(() => {
  const SPEEDS = [0.5, 1, 2, 5, 10, 20, 50, 100];
  const ICONS = { play: "M4 2.5v11l10-5.5z", pause: "M4 2.5h3v11H4zM9.5 2.5h3v11h-3z" };

  const shape = (path) => {
    const svg = document.createElementNS("http://www.w3.org/2000/svg", "svg");
    svg.setAttribute("viewBox", "0 0 16 16");
    svg.setAttribute("aria-hidden", "true");
    const line = document.createElementNS("http://www.w3.org/2000/svg", "path");
    line.setAttribute("d", path);
    svg.append(line);
    return svg;
  };

  const paintStrip = (page, strip) => {
    const run = page.active();
    const width = Math.max(1, strip.clientWidth);
    strip.width = width;
    strip.height = 8;
    const context = strip.getContext("2d");
    for (let x = 0; x < width; x += 1) {
      const status = run.statusAt(page.start + ((page.end - page.start) * x) / width);
      context.fillStyle = MF.statusColor(status);
      // Uncertain and lost are told by their height too; a pause without an epoch is a thin line.
      const top = status === "NO DATA" ? 7 : status === "LOST" || status === "OUTSIDE" ? 4 : status === "UNCERTAIN" ? 2 : 0;
      context.fillRect(x, top, 1, 8 - top);
    }
  };

  MF.makePlayer = (page, host) => {
    const { store } = page;
    const play = MF.h("button", { class: "play", type: "button", id: "play", onclick: () => page.play(!store.state.playing) });
    const button = (words, label, onclick) => MF.h("button", { class: "icon", type: "button", "aria-label": label, title: label, onclick }, words);
    const slider = MF.h("input", { type: "range", id: "time", min: page.start, max: page.end, step: "any", "aria-label": "Time" });
    const strip = MF.h("canvas", { "aria-hidden": "true" });
    const clock = MF.h("output", { class: "clock", for: "time" });
    const speed = MF.h("select", { id: "speed", "aria-label": "Speed" }, SPEEDS.map((one) => MF.h("option", { value: one }, `${one}×`)));
    const follow = page.live ? MF.h("button", { type: "button", id: "follow", title: "Stay at the newest fix (L)",
      onclick: () => page.follow(!store.state.follow) }, "Follow") : null;
    const link = page.live ? MF.h("span", { class: "pill", id: "link" }, page.live.state) : null;
    page.live?.listeners.push((state) => {
      if (link.textContent === state) return;
      link.textContent = state;
      link.style.setProperty("--dot", state === "live" ? MF.color.converged : MF.color.lost);
      MF.say(`Connection: ${state}`);
    });
    host.replaceChildren(
      MF.h("div", { class: "buttons" }, button("‹", "One epoch back (left arrow)", () => page.step(-1)), play, button("›", "One epoch on (right arrow)", () => page.step(1)), speed, follow, link),
      MF.h("div", { class: "timeline" }, strip, slider), clock);
    host.hidden = false;
    slider.addEventListener("input", () => page.seek(Number(slider.value)));
    speed.addEventListener("change", () => store.set({ speed: Number(speed.value) }));

    let drawn = null;
    const refresh = () => {
      const { time, playing } = store.state;
      const run = page.active();
      if (page.live) { slider.min = page.start; slider.max = page.end; }
      slider.value = time;
      follow?.setAttribute("aria-pressed", String(store.state.follow));
      const since = time - page.start;
      slider.setAttribute("aria-valuetext", `${MF.clock(since)} of ${MF.clock(page.end - page.start)}, ${run.statusAt(time).toLowerCase()}`);
      const utc = Number.isFinite(run.data.start_utc_s ?? NaN) ? ` · ${new Date(Math.round(1000 * (run.data.start_utc_s + time))).toISOString().slice(11, 19)} UTC` : "";
      clock.replaceChildren(`${MF.clock(since)} `, MF.h("small", {}, `/ ${MF.clock(page.end - page.start)}${utc}`));
      if (drawn !== playing) {
        drawn = playing;
        play.replaceChildren(shape(playing ? ICONS.pause : ICONS.play));
        play.setAttribute("aria-label", playing ? "Pause (space)" : "Play (space)");
        play.title = playing ? "Pause (space)" : "Play (space)";
      }
      speed.value = String(store.state.speed);
    };
    return { refresh, strip: () => paintStrip(page, strip) };
  };

  MF.KEYS = [["Space", "play or pause"], ["← →", "one epoch back, one epoch on"], ["Page ↑ ↓", "ten seconds on, ten seconds back"], ["Home End", "start, end"],
    ["[ ]", "slower, faster"], ["P N", "previous, next report that was used"], ["1 2 …", "choose a run"], ["L", "live: stay at the newest fix, or not"],
    ["Click, Enter on a map", "why is the position not there?"], ["Esc", "clear that place"], ["Shift + arrows", "move a map that has the focus"],
    ["+ −", "zoom a map that has the focus"], ["F", "show everything"], ["D", "dark or light"], ["?", "this help"]];

  MF.listenToKeys = (page) => {
    const { store } = page;
    const faster = (by) => store.set({ speed: SPEEDS[MF.clamp(SPEEDS.indexOf(store.state.speed) + by, 0, SPEEDS.length - 1)] });
    const timed = { " ": () => page.play(!store.state.playing), ArrowLeft: () => page.step(-1), ArrowRight: () => page.step(1),
      PageUp: () => page.seek(store.state.time + 10), PageDown: () => page.seek(store.state.time - 10),
      Home: () => page.seek(page.start), End: () => page.seek(page.end), "[": () => faster(-1), "]": () => faster(1),
      l: () => page.live && page.follow(!store.state.follow), n: () => page.stepReport(1), p: () => page.stepReport(-1) };
    const always = { Escape: () => store.set({ place: null, against: "runner" }), f: () => page.fit(), d: () => MF.toggleTheme(), "?": () => page.help() };
    document.addEventListener("keydown", (event) => {
      if (event.ctrlKey || event.metaKey || event.altKey || event.defaultPrevented) return;
      const typed = event.target.closest?.("select, dialog, summary");
      if (typed || (event.key === " " && event.target.closest?.("button, [type=checkbox]"))) return;
      const key = event.key.length === 1 ? event.key.toLowerCase() : event.key;
      const action = always[key] ?? (page.runs.length ? timed[key] : undefined);
      if (action) { action(); event.preventDefault(); return; }
      const run = Number(key) - 1;
      if (Number.isInteger(run) && run >= 0 && run < page.runs.length) store.set({ run });
    });
  };
})();
