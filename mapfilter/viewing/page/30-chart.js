"use strict";
// One chart over time on uPlot: keys with the values of the moment, a line at the moment, click to seek.
(() => {
  const SYNC = "mapfilter";
  const HEIGHT = 148;

  const axis = (side, scale, format, grid) => ({ side, scale, stroke: MF.color.soft, font: "11px system-ui, sans-serif", size: side === 2 ? 26 : 46,
    grid: { show: grid, stroke: MF.color.line, width: 1 }, ticks: { show: false }, gap: 4,
    values: (_, values) => values.map((value) => (value === null ? "" : format(value))) });

  // series: [{label, values, color, dash, points, scale, format}], lines: [{at, label}] across the scale "y".
  MF.makeChart = (page, spec) => {
    const keys = MF.h("div", { class: "keys" });
    const host = MF.h("div", {});
    const title = MF.h("header", {}, MF.h("h2", {}, spec.title), spec.control ?? null);
    const element = MF.h("figure", { class: "card chart", "aria-label": spec.title }, title, keys, host);
    const head = MF.h("div", { style: { position: "absolute", top: "0", bottom: "0", width: "2px", background: "var(--accent)", "pointer-events": "none" } });
    let plot = null;
    let series = [];
    let times = [];
    let shown = null;
    let plotted = [];

    const marks = (u) => {
      for (const { at, label } of spec.lines ?? []) {
        const y = u.valToPos(at, "y", true);
        if (!(y > u.bbox.top && y < u.bbox.top + u.bbox.height)) continue;
        const ratio = window.devicePixelRatio || 1;
        u.ctx.save();
        u.ctx.strokeStyle = MF.color.lost;
        u.ctx.setLineDash([5 * ratio, 4 * ratio]);
        u.ctx.lineWidth = ratio;
        u.ctx.beginPath();
        u.ctx.moveTo(u.bbox.left, y);
        u.ctx.lineTo(u.bbox.left + u.bbox.width, y);
        u.ctx.stroke();
        u.ctx.fillStyle = MF.color.soft;
        u.ctx.font = `${10.5 * ratio}px system-ui, sans-serif`;
        u.ctx.textAlign = "right";
        u.ctx.fillText(label, u.bbox.left + u.bbox.width - 4 * ratio, y - 4 * ratio);
        u.ctx.restore();
      }
    };
    const options = (width) => {
      const two = series.some((one) => one.scale === "y2");
      return { width, height: HEIGHT, padding: [8, two ? 0 : 10, 0, 0], legend: { show: false },
        cursor: { sync: { key: SYNC, setSeries: false }, drag: { x: true, y: false }, points: { size: 6 } },
        scales: { x: { time: false }, y: spec.y ?? {}, y2: spec.y2 ?? {} },
        axes: [axis(2, "x", page.clock, true), axis(3, "y", (value) => MF.number(value, spec.digits ?? 0), true),
          ...(two ? [axis(1, "y2", spec.format2 ?? ((value) => MF.number(value)), false)] : [])],
        series: [{}, ...series.map((one) => ({ label: one.label, scale: one.scale ?? "y", stroke: one.color, width: one.width ?? 1.6, dash: one.dash,
          spanGaps: false, points: one.points ? { show: true, size: 4, fill: one.color, width: 0 } : { show: false },
          paths: one.points ? () => null : undefined }))],
        hooks: { draw: [marks] } };
    };
    // uPlot draws gaps at null; infinite values would spoil a scale.
    const columns = () => {
      plotted = [times[0], times[times.length - 1]];
      const run = page.active();
      const made = [Array.from(times), ...series.map((one) => Array.from(one.values, (value) => (Number.isFinite(value) ? value : null)))];
      // A line across a pause would be an invention; a cell may be received seldom without one.
      for (let i = times.length - 1; i > 0; i -= 1) {
        if (times[i] - times[i - 1] > run.pause && run.isSilentBetween(times[i - 1], times[i])) made.forEach((column, n) => column.splice(i, 0, n ? null : times[i - 1] + 1e-3));
      }
      return made;
    };
    const build = () => {
      plot?.destroy();
      [series, times, shown] = [[], [], null];
      const made = spec.data();
      if (!made || !made.series.length) {
        plot = null;
        host.replaceChildren(MF.h("p", { class: "empty" }, spec.empty ?? "No data."));
        return;
      }
      ({ series, times } = made);
      host.replaceChildren();
      plot = new uPlot(options(Math.max(host.clientWidth, 200)), columns(), host);
      plot.over.append(head);
      let from = 0;
      plot.over.addEventListener("mousedown", (event) => { from = event.clientX; });
      plot.over.addEventListener("click", (event) => {
        if (Math.abs(event.clientX - from) > 4) return;
        page.seek(plot.posToVal(event.clientX - plot.over.getBoundingClientRect().left, "x"));
      });
      plot.root.setAttribute("aria-hidden", "true");
    };
    const refresh = (time) => {
      if (!plot) { keys.replaceChildren(); return; }
      // Before the first value there is none.
      const i = time < times[0] ? -1 : MF.lastAt(times, time);
      head.style.transform = `translateX(${plot.valToPos(time, "x")}px)`;
      head.hidden = time < plot.scales.x.min || time > plot.scales.x.max;
      if (i === shown) return;
      shown = i;
      keys.replaceChildren(...series.map((one) => MF.h("span", {}, MF.h("i", { class: one.points ? "dots" : one.dash ? "dashed" : "", style: { "border-color": one.color } }),
        one.label, MF.h("b", {}, (one.format ?? MF.number)(one.values[i])))));
    };
    // New values at the end; who has zoomed in keeps what is seen.
    const grow = () => {
      const made = spec.data();
      if (!plot || !made || made.series.length !== series.length) { build(); return; }
      const { min, max } = plot.scales.x;
      const zoomed = min > plotted[0] || max < plotted[1];
      ({ series, times } = made);
      shown = null;
      plot.setData(columns(), !zoomed);
      if (zoomed) plot.redraw();
    };
    const resize = () => { if (plot && host.clientWidth) plot.setSize({ width: host.clientWidth, height: HEIGHT }); };
    return { element, build, grow, refresh, resize };
  };
})();
