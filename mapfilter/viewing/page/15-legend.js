"use strict";
// The legend of a map: what the signs mean, and the scale of the layer under them.
(() => {
  const sign = (paint) => {
    const canvas = MF.h("canvas", { "aria-hidden": "true", width: 68, height: 32 });
    const context = canvas.getContext("2d");
    context.scale(2, 2);
    const view = { width: 34, height: 16 };
    const camera = { east: 0, north: 0, scale: 1, x: (e) => e, y: (n) => n };
    paint(MF.canvasPen(context, camera, view));
    return canvas;
  };
  const line = (style) => sign((pen) => pen.path([[2, 8], [32, 8]], style));

  const signs = (bundle, run) => {
    const { color } = MF;
    const list = [];
    const seen = new Set(run.epochs.status);
    bundle.statuses.forEach((name, code) => {
      if (!seen.has(code)) return;
      const words = name.toLowerCase();
      list.push([line({ stroke: MF.statusColor(name), width: 3.5, dash: MF.dashOf(name) }), `estimate, ${words}`]);
    });
    list.push([sign((pen) => pen.circle(17, 8, 6, { fill: color.tracking, stroke: color.ink })), "estimate now, with its mass within 50 m"]);
    list.push([sign((pen) => {
      pen.circle(17, 8, 7, { stroke: color.tracking, width: 1.6 });
      pen.circle(17, 8, 4, { fill: color.tracking, alpha: 0.3 });
    }), "50 % and 95 % regions"]);
    if (run.epochs.protection?.some(Number.isFinite)) list.push([sign((pen) => pen.circle(17, 8, 7, { stroke: color.ink, dash: [2, 3] })), "protection level"]);
    if (run.belief) list.push([sign((pen) => [0.15, 0.4, 0.9].forEach((alpha, k) => pen.rect(4 + 9 * k, 3, 9, 10, { fill: color.belief, alpha }))), "belief: darker is likelier"]);
    if (run.hasTruth) list.push([sign((pen) => {
      pen.path([[2, 8], [32, 8]], { stroke: color.truth, width: 5, alpha: 0.4 });
      pen.path([[17, 2], [23, 8], [17, 14], [11, 8]], { fill: color.card, stroke: color.truth, width: 2 }, true);
    }), "ground truth"]);
    if (run.epochs.runner_mass?.some((one) => one > 0)) {
      list.push([sign((pen) => pen.rect(11, 2, 12, 12, { fill: color.card, stroke: color.there, width: 2.2 })), "runner-up, with its mass"]);
    }
    if (run.epochs.alt_lead?.some(Number.isFinite)) {
      list.push([sign((pen) => pen.path([[17, 2], [24, 14], [10, 14]], { fill: color.card, stroke: color.alternative, width: 2.2 }, true)), "alternative hypothesis"]);
    }
    if (run.epochs.way?.some((one) => one > 0)) list.push([line({ stroke: color.accent, width: 7, alpha: 0.3 }), "matched way"]);
    if (bundle.cells.length) {
      list.push([line({ stroke: color.accent, width: 2 }), "serving cell"]);
      list.push([line({ stroke: color.soft, width: 1.2, dash: [3, 4] }), "neighbour cells of the report"]);
    }
    return list;
  };

  const SHOWN = [["belief", "belief"], ["regions", "regions"], ["hypotheses", "hypotheses"], ["radio", "cells heard"]];
  const isThere = { belief: (bundle, run) => Boolean(run.belief), radio: (bundle) => bundle.cells.length > 0 };
  const switches = (store, bundle, run) => MF.h("p", { class: "switches" }, SHOWN.filter(([key]) => isThere[key]?.(bundle, run) ?? true).map(([key, words]) => {
    const box = MF.h("input", { type: "checkbox" });
    box.checked = store.state.show[key];
    box.addEventListener("change", () => store.set({ show: { ...store.state.show, [key]: box.checked } }));
    return MF.h("label", {}, box, words);
  }));

  MF.fillLegend = (legend, { bundle, run, layer, store }) => {
    const items = run ? signs(bundle, run) : [];
    if (bundle.cells.length) {
      items.push([sign((pen) => pen.path([[17, 14], [11, 3], [17, 1], [23, 3]], { fill: MF.color.card, stroke: MF.color.soft, width: 1.4 }, true)), "site and sector"]);
    }
    const parts = [MF.h("summary", {}, "Legend")];
    if (layer && !layer.plain) {
      parts.push(MF.h("h3", {}, layer.title + (layer.unit ? ` / ${layer.unit}` : "")));
      if (layer.range) {
        const { range } = layer;
        parts.push(MF.h("div", { class: "ramp", style: { background: MF.VIRIDIS_CSS } }),
          MF.h("div", { class: "ramp-words" }, [range[0], (range[0] + range[1]) / 2, range[1]].map((value) => MF.h("span", {}, MF.number(value, range[1] - range[0] < 4 ? 1 : 0)))));
      }
      if (layer.swatches) {
        parts.push(MF.h("div", { class: "swatches" }, layer.swatches.map(({ name, color }) =>
          MF.h("span", {}, MF.h("i", { style: { background: color } }), name))));
      }
    }
    parts.push(MF.h("ul", {}, items.map(([canvas, words]) => MF.h("li", {}, canvas, words))), run ? switches(store, bundle, run) : "");
    legend.replaceChildren(...parts);
  };
})();
