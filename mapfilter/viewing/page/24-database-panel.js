"use strict";
// The side of a database's page: its cells, and the levels at a place.
(() => {
  MF.makeDatabasePanels = (page) => {
    const { ground, store } = page;
    const body = MF.h("div", {});
    const here = MF.h("section", { class: "card levels", "aria-labelledby": "levels-title" },
      MF.h("header", {}, MF.h("h2", { id: "levels-title" }, "Levels at a place")), body);
    const table = MF.h("table", {}, MF.h("thead", {}, MF.h("tr", {}, ["Cell", "Site", "Azimuth", "Height", "ARFCN"].map((words) => MF.h("th", { scope: "col" }, words)))));
    const rows = ground.cells.map((cell, index) => MF.h("tr", {},
      MF.h("td", {}, ground.levels?.band.has(index) ? MF.h("button", { class: "link", type: "button", onclick: () => store.set({ layer: "level", layerCell: index }) }, ground.cellName(index)) : ground.cellName(index)),
      MF.h("td", {}, cell.site ?? "–"), MF.h("td", {}, Number.isFinite(cell.azimuth_deg ?? NaN) ? `${cell.azimuth_deg}°` : "all round"),
      MF.h("td", {}, MF.number(cell.height_m ?? NaN, 0, "m")), MF.h("td", {}, cell.arfcn ?? "–")));
    table.append(MF.h("tbody", {}, rows));
    const cells = MF.h("section", { class: "card levels", "aria-labelledby": "cells-title" },
      MF.h("header", {}, MF.h("h2", { id: "cells-title" }, "Cells"), MF.h("span", { class: "quiet" }, `${ground.cells.length}`)),
      ground.cells.length ? MF.h("div", { class: "scroll" }, table) : MF.h("p", { class: "empty" }, "This database has no cells."));

    here.refresh = () => {
      const { place, layer, layerCell } = store.state;
      rows.forEach((row, index) => row.setAttribute("aria-selected", String(layer === "level" && layerCell === index)));
      if (!place) {
        body.replaceChildren(MF.h("p", { class: "empty" }, "Click on the map, or press Enter on it, to read the predicted levels of all cells."));
        return;
      }
      const spot = ground.lonLat(place.east, place.north);
      const list = ground.levelsAt(place.east, place.north);
      const best = ground.bestAt(place.east, place.north);
      const lines = list.map(({ cell, level }) => MF.h("tr", {}, MF.h("td", {}, ground.cellName(cell)), MF.h("td", {}, MF.dbm(level)),
        MF.h("td", {}, MF.h("span", { class: "meter", "aria-hidden": "true", style: { width: `${MF.clamp(1.2 * (level + 115), 1, 90)}px` } }))));
      body.replaceChildren(MF.h("p", { class: "quiet number" }, spot ? MF.degrees(spot.lat, spot.lon) : ""),
        best ? MF.h("p", {}, `Best server ${ground.cellName(best.cell)}, ${MF.dbm(best.level)}; ${best.margin === Infinity ? "no second cell" : `${MF.number(best.margin, 1, "dB")} above the second`}.`) : MF.h("p", { class: "empty" }, "No point of the database here."),
        lines.length ? MF.h("table", {}, MF.h("tbody", {}, lines)) : "");
    };
    return { elements: [here, cells], refresh: here.refresh };
  };
})();
