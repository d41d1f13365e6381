"use strict";
// The charts of a run: how sure, doubt, error and radius, levels.
(() => {
  const some = (values) => Boolean(values) && values.some(Number.isFinite);
  const positive = (values) => Float64Array.from(values, (value) => (Number.isFinite(value) ? Math.max(value, 0.5) : NaN));

  const others = (page, run, key, label, change = (values) => values) => page.runs.filter((one) => one !== run && some(one.epochs[key]))
    .map((one) => ({ one, label: `${label}, ${one.name}`, values: change(onTimes(one, key, run.epochs.time)) }));
  // Values of another run at the times of this one; within its pauses there are none.
  const onTimes = (other, key, times) => Float64Array.from(times, (time) =>
    (time < other.start - 1 || time > other.end + 1 || other.statusAt(time) === "NO DATA" ? NaN : other.epochs[key][other.at(time)]));

  const sureness = (page) => MF.makeChart(page, { title: "Entropy and mass within 50 m", digits: 0, y2: { range: [0, 1.02] },
    format2: (value) => MF.number(100 * value, 0, "%"),
    data: () => {
      const run = page.active();
      const e = run.epochs;
      const series = [];
      if (some(e.entropy)) series.push({ label: "entropy", values: e.entropy, color: MF.color.belief, format: (value) => MF.number(value, 1, "bit") });
      if (some(e.mass)) series.push({ label: "mass", values: e.mass, color: MF.color.tracking, dash: [6, 3], scale: "y2", format: MF.share });
      return { times: e.time, series };
    } });

  const doubt = (page) => {
    const spec = { title: "Doubt that the map explains the readings / nats", digits: 0, lines: [],
      y: { range: (u, low, high) => [Math.min(low, -1) - 1, Math.max(high, page.active().data.thresholds?.lost ?? 0) + 2] }, empty: "This filter keeps no doubt statistic.",
      data: () => {
        const run = page.active();
        const e = run.epochs;
        const { thresholds } = run.data;
        spec.lines = [["start_log_odds", "starts an alternative"], ["search", "searches"], ["lost", "lost"]]
          .filter(([key]) => Number.isFinite(thresholds?.[key])).map(([key, label]) => ({ at: thresholds[key], label }));
        const series = [];
        if (some(e.doubt)) series.push({ label: "doubt (log odds)", values: e.doubt, color: MF.color.lost, format: (value) => MF.number(value, 1) });
        if (some(e.alt_lead)) series.push({ label: "lead of the alternative", values: e.alt_lead, color: MF.color.alternative, dash: [6, 3], format: (value) => MF.nats(value, 1) });
        return { times: e.time, series };
      } };
    return MF.makeChart(page, spec);
  };

  const errors = (page) => MF.makeChart(page, { title: "Error and radius / m", y: { distr: 3, range: (u, low, high) => [Math.max(0.5, low / 1.5), high * 1.5] },
    data: () => {
      const run = page.active();
      const e = run.epochs;
      const series = [];
      if (some(e.r95)) series.push({ label: "95 % radius", values: positive(e.r95), color: MF.color.tracking, format: MF.metres });
      if (some(e.protection)) series.push({ label: "protection level", values: positive(e.protection), color: MF.color.soft, dash: [2, 4], format: MF.metres });
      if (some(e.error)) series.push({ label: "error", values: positive(e.error), color: MF.color.lost, width: 2, format: MF.metres });
      for (const { label, values } of others(page, run, "error", "error", positive)) {
        series.push({ label, values, color: MF.color.outside, dash: [6, 3], width: 1.4, format: MF.metres });
      }
      return { times: e.time, series };
    } });

  // Level of one cell over time, from all readings of it.
  const levelsOf = (run, cell) => {
    const { readings, count, epochs } = run;
    const [times, level, predicted] = [[], [], []];
    for (let i = 0; i < count; i += 1) {
      for (let r = readings.first.raw[i]; r < readings.first.raw[i + 1]; r += 1) {
        if (readings.cell.raw[r] !== cell) continue;
        // A line across a time without readings would be an invention.
        if (times.length && epochs.time[i] - times[times.length - 1] > 60) {
          times.push(times[times.length - 1] + 1);
          level.push(NaN);
          predicted.push(NaN);
        }
        times.push(epochs.time[i]);
        level.push(readings.level.at(r));
        predicted.push(readings.predicted.at(r));
        break;
      }
    }
    return { times, level, predicted };
  };
  const levels = (page) => {
    const select = MF.h("select", { "aria-label": "Cell of the chart of levels" });
    let shown = null;
    const fill = () => {
      const run = page.active();
      if ((shown === run && !run.live) || !run.readings.first) return;
      shown = run;
      const chosen = select.value;
      const counts = new Map();
      for (const cell of run.readings.cell.raw) if (cell >= 0) counts.set(cell, (counts.get(cell) ?? 0) + 1);
      const cells = [...counts].sort((a, b) => b[1] - a[1]);
      select.replaceChildren(...cells.map(([cell, count]) => MF.h("option", { value: cell }, `${page.ground.cellName(cell)} (${count})`)));
      // While cells are added the chosen one stays.
      if (run.live && [...select.options].some((one) => one.value === chosen)) select.value = chosen;
    };
    const chart = MF.makeChart(page, { title: "Level / dBm", control: MF.h("label", { class: "field" }, "cell", select), empty: "No level of a known cell was measured.",
      data: () => {
        const run = page.active();
        fill();
        if (!select.options.length) return null;
        const { times, level, predicted } = levelsOf(run, Number(select.value));
        return { times, series: [
          { label: "measured", values: level, color: MF.color.lost, points: true, format: MF.dbm },
          { label: "predicted at the estimate", values: predicted, color: MF.color.tracking, format: MF.dbm }] };
      } });
    select.addEventListener("change", () => { chart.build(); chart.refresh(page.store.state.time); });
    return chart;
  };

  MF.makeCharts = (page, host) => {
    const charts = [errors(page), sureness(page), levels(page), doubt(page)];
    host.replaceChildren(...charts.map((one) => one.element));
    return {
      build: () => charts.forEach((one) => one.build()),
      grow: () => charts.forEach((one) => one.grow()),
      refresh: (time) => charts.forEach((one) => one.refresh(time)),
      resize: () => charts.forEach((one) => one.resize()),
    };
  };
})();
