"use strict";
// One map: two canvases (what stays, what moves), pointer and keys, hover and legend.
(() => {
  const fit = (canvas, view) => {
    const ratio = Math.min(window.devicePixelRatio || 1, 2);
    const [width, height] = [Math.round(view.width * ratio), Math.round(view.height * ratio)];
    if (canvas.width !== width || canvas.height !== height) { canvas.width = width; canvas.height = height; }
    const context = canvas.getContext("2d");
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    return context;
  };

  const icon = (words, label, onclick) => MF.h("button", { class: "icon", type: "button", "aria-label": label, title: label, onclick }, words);

  const hoverWords = (page, run, east, north) => {
    const { ground } = page;
    const rows = [];
    const add = (name, value) => rows.push(MF.h("tr", {}, MF.h("td", {}, name), MF.h("td", {}, value)));
    const spot = ground.lonLat(east, north);
    const best = ground.bestAt(east, north);
    if (best) {
      add(`best server ${ground.cellName(best.cell)}`, MF.dbm(best.level));
      add("margin over the second", best.margin === Infinity ? "no second cell" : MF.number(best.margin, 1, "dB"));
    }
    const levels = ground.levelsAt(east, north);
    const { layer, layerCell } = page.store.state;
    if (layer === "level") {
      const own = levels.find((one) => one.cell === layerCell);
      add(`level of ${ground.cellName(layerCell)}`, own ? MF.dbm(own.level) : "below the floor");
    }
    for (const one of levels.slice(0, 4)) {
      if (one.cell !== best?.cell && !(layer === "level" && one.cell === layerCell)) add(ground.cellName(one.cell), MF.dbm(one.level));
    }
    for (const one of ground.boundsAt(east, north)) add(one.name, MF.number(one.at, 0, one.unit));
    if (run) {
      const here = run.place(run.at(page.store.state.time));
      const away = Math.hypot(east - here.east, north - here.north);
      if (Number.isFinite(away)) add("from the estimate", MF.metres(away));
    }
    if (!rows.length) add("no prediction here", "");
    return [MF.h("table", {}, rows), spot ? MF.h("p", { class: "quiet" }, MF.degrees(spot.lat, spot.lon)) : null];
  };

  MF.makeMap = (page, run, several) => {
    const { ground, camera, store, bundle } = page;
    const still = MF.h("canvas", { "aria-hidden": "true" });
    const moving = MF.h("canvas", { "aria-hidden": "true" });
    const tip = MF.h("div", { class: "tip", hidden: true });
    const name = run ? run.name : bundle.title;
    const hint = run ? " Arrow keys with Shift move it, plus and minus zoom, Enter asks why the position is not at its center."
      : " Arrow keys move it, plus and minus zoom, Enter reads the levels at its center.";
    const sheet = MF.h("div", { class: "sheet", tabindex: "0", role: "application", "aria-label": `Map of ${name}.${hint}` },
      still, moving, tip);
    const legend = MF.h("details", { class: "legend" });
    legend.open = window.innerWidth > 1100 && !several;
    const zoom = MF.h("div", { class: "zoom" },
      icon("+", "Zoom in", () => camera.zoom(1.5, map.view.width / 2, map.view.height / 2, map.view)),
      icon("−", "Zoom out", () => camera.zoom(1 / 1.5, map.view.width / 2, map.view.height / 2, map.view)),
      icon("⤢", "Show everything", () => page.fit()),
      run ? icon("◎", "Go to the estimate", () => page.center()) : null);
    const pill = run ? MF.h("span", { class: "pill" }) : null;
    const head = several ? MF.h("header", {}, MF.h("h2", {}, name), pill) : null;
    const credit = MF.h("p", { class: "credit" }, bundle.attribution ?? "");
    sheet.append(zoom, legend, credit);
    const element = MF.h("article", { class: "card map", "aria-label": name }, head, sheet);
    const density = MF.makeDensity();
    const map = { run, element, sheet, view: { width: 300, height: 300 }, dirty: true };

    map.resize = () => {
      const width = sheet.clientWidth;
      const height = sheet.clientHeight;
      if (!width || !height) return false;
      const changed = width !== map.view.width || height !== map.view.height;
      map.view = { width, height };
      map.dirty = true;
      return changed;
    };
    const layerNow = () => page.layers(store.state.layer, store.state.layerCell);
    const pointsNow = () => (ground.points && (!ground.streets || store.state.layer === "points") ? page.points() : null);
    const paintStill = (pen) => MF.drawGround(pen, { ground, layer: layerNow(), points: pointsNow(), run, withSites: !run });
    const paintMoving = (pen) => {
      const { time, place, show } = store.state;
      if (run && run.count) {
        const i = run.at(time);
        MF.drawMoment(pen, { ground, run, i, status: run.statusAt(time), density: show.belief ? density(run, run.frameAt(i)) : null, place, show });
      } else if (place) MF.drawPlace(pen, place, "");
      MF.drawScaleBar(pen);
    };
    map.draw = () => {
      if (map.dirty) {
        paintStill(MF.canvasPen(fit(still, map.view), camera, map.view));
        map.dirty = false;
      }
      const context = fit(moving, map.view);
      context.clearRect(0, 0, map.view.width, map.view.height);
      paintMoving(MF.canvasPen(context, camera, map.view));
      if (run && pill) {
        const status = run.statusAt(store.state.time);
        pill.textContent = status.toLowerCase();
        pill.style.setProperty("--dot", MF.statusColor(status));
      }
    };
    map.paintAll = (pen) => { paintStill(pen); paintMoving(pen); };
    map.refreshLegend = () => MF.fillLegend(legend, { bundle, run, layer: layerNow(), store });

    MF.listenToPointer(page, map, (event) => {
      if (!event) { tip.hidden = true; return; }
      tip.hidden = false;
      tip.replaceChildren(...hoverWords(page, run, event.east, event.north).filter(Boolean));
      tip.style.left = `${MF.clamp(event.x + 16, 4, Math.max(4, map.view.width - tip.offsetWidth - 4))}px`;
      tip.style.top = `${MF.clamp(event.y + 16, 4, Math.max(4, map.view.height - tip.offsetHeight - 4))}px`;
    });
    return map;
  };
})();
