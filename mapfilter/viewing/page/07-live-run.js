"use strict";
// A run that grows by the events of a service; it has the shape of a run of a bundle.
(() => {
  const [MOST_EPOCHS, DROPPED, MOST_FRAMES] = [20000, 5000, 300];
  const NAMES = ["number", "time", "east", "north", "status", "reason", "r50", "r95", "r99", "protection", "mass", "entropy", "log_evidence",
    "hypotheses", "runner_east", "runner_north", "runner_mass", "way", "way_p", "doubt", "alt_east", "alt_north", "alt_lead", "alt_mass", "serving", "came"];
  const column = () => ({ raw: [], at(i) { return this.raw[i] ?? NaN; } });
  const table = (names) => Object.fromEntries(names.map((name) => [name, column()]));

  MF.makeLiveRun = (bundle, name) => {
    const [west, south] = bundle.frame.origin;
    const ways = new Map((bundle.background?.ways ?? []).map((way, i) => [way.id, i + 1]));
    const epochs = Object.fromEntries(NAMES.map((one) => [one, []]));
    const readings = { first: { raw: [0] }, ...table(["cell", "level", "predicted"]) };
    let [rows, unused, frames, reasons, came] = [[], [], [], [], 0];
    const run = { index: 0, bundle, name, epochs, readings, live: true, count: 0, start: 0, end: 0, last: 0, missed: 0, belief: null, explained: null,
      truth: null, hasTruth: false, reports: [], reportEpochs: [], data: { name, thresholds: bundle.thresholds, notes: [], figures: {} } };

    const settle = () => {
      run.count = epochs.time.length;
      run.start = epochs.time[0] ?? 0;
      run.end = epochs.time[run.count - 1] ?? 0;
      run.data.start_utc_s = MF.isDate(run.start) ? 0 : null;
      run.last = epochs.number[run.count - 1] ?? run.last;
      run.belief = frames.length ? frames : null;
      run.explained = reasons.length ? { epoch: { raw: reasons.map((one) => one.epoch) }, ...Object.fromEntries(["lead_sum", "runner_sum", "alt_sum", "runner_prior"]
        .map((key) => [key, reasons.map((one) => one[key])])) } : null;
      run.reports = reasons.flatMap((one, x) => (one.rows.some((row) => row.term !== "streets") ? [x] : []));
      run.reportEpochs = run.reports.map((x) => reasons[x].epoch);
    };
    // Only the epochs from..to-1 stay.
    const keep = (from, to) => {
      const { raw } = readings.first;
      for (const one of ["cell", "level", "predicted"]) readings[one].raw = readings[one].raw.slice(raw[from], raw[to]);
      readings.first.raw = raw.slice(from, to + 1).map((at) => at - raw[from]);
      for (const values of Object.values(epochs)) { values.length = to; values.splice(0, from); }
      [rows, unused] = [rows.slice(from, to), unused.slice(from, to)];
      [frames, reasons] = [frames, reasons].map((list) => list.filter((one) => one.epoch >= from && one.epoch < to).map((one) => ({ ...one, epoch: one.epoch - from })));
    };

    const add = (fix) => {
      const { detail } = fix;
      const other = detail?.alternative;
      const known = (detail?.readings ?? []).map((one) => ({ cell: one.cell, role: one.role, what: one.name, level: one.level_dbm ?? NaN,
        predicted: one.predicted_dbm ?? NaN, reason: one.use, used: one.use === "used", censored: one.censored ?? 0 }));
      came += 1;
      const values = { came, number: fix.number, time: fix.time_s, east: fix.east_m - west, north: fix.north_m - south, status: bundle.statuses.indexOf(fix.status),
        reason: bundle.reasons.indexOf(fix.reason), r50: fix.radius_50_m, r95: fix.radius_95_m, r99: fix.radius_99_m,
        // JSON has no infinity: a level that is missing beside radii is infinite.
        protection: fix.protection_m ?? (Number.isFinite(fix.radius_99_m) ? Infinity : NaN),
        mass: fix.mass_50m, entropy: fix.entropy_bits, log_evidence: fix.log_evidence, hypotheses: fix.hypotheses,
        runner_east: fix.runner_up_east_m - west, runner_north: fix.runner_up_north_m - south, runner_mass: fix.runner_up_mass,
        way: ways.get(String(fix.way_id)) ?? 0, way_p: fix.way_probability, doubt: detail?.doubt, alt_east: other ? other.east_m - west : NaN,
        alt_north: other ? other.north_m - south : NaN, alt_lead: other?.lead, alt_mass: other?.mass_50m,
        serving: known.find((one) => one.role === "serving" && one.cell >= 0)?.cell ?? -1 };
      // null minus a number is a number: what is unknown must stay so.
      if (fix.east_m === null) values.east = values.north = NaN;
      if (fix.runner_up_east_m === null) values.runner_east = values.runner_north = NaN;
      for (const one of NAMES) epochs[one].push(values[one] ?? NaN);
      for (const one of known) for (const part of ["cell", "level", "predicted"]) readings[part].raw.push(one[part]);
      readings.first.raw.push(readings.cell.raw.length);
      rows.push(known);
      unused.push(fix.unused.filter((one) => one.kind !== "serving" && one.kind !== "neighbour").map((one) => ({ ...one, count: 1 })));
      if (!detail?.explained) return;
      const list = detail.explained.rows.map((one) => ({ term: one.term, cell: one.cell, measured: one.measured_dbm ?? NaN, herePredicted: one.lead_dbm ?? NaN,
        runnerPredicted: one.runner_dbm ?? NaN, lead: one.lead ?? NaN, runner: one.runner ?? NaN, alt: one.alternative ?? NaN }));
      const sum = (key) => list.reduce((total, one) => total + one[key], 0);
      reasons.push({ epoch: epochs.time.length - 1, rows: list, lead_sum: sum("lead"), runner_sum: sum("runner"), alt_sum: sum("alt"), runner_prior: detail.explained.prior ?? NaN });
    };
    run.push = (fix) => {
      // A service that went back to what it had saved sends later numbers again.
      const again = epochs.number.findIndex((one) => one >= fix.number);
      if (again >= 0) keep(0, again);
      else if (run.count) run.missed += fix.number - run.last - 1;
      add(fix);
      if (epochs.time.length > MOST_EPOCHS) keep(DROPPED, epochs.time.length);
      settle();
    };
    run.pushBelief = (belief) => {
      const epoch = epochs.number.lastIndexOf(belief.number);
      if (epoch < 0) return;
      const step = belief.step_m;
      const [c, r] = [Math.round(west / step), Math.round(south / step)];
      const numbers = (one) => MF.array(one).raw;
      frames = frames.filter((one) => one.epoch !== epoch).slice(1 - MOST_FRAMES);
      frames.push({ epoch, from: 0, to: belief.mass.s[0], col: numbers(belief.col).map((one) => one - c), row: numbers(belief.row).map((one) => one - r),
        mass: numbers(belief.mass), step, peak: belief.peak });
      frames.sort((a, b) => a.epoch - b.epoch);
      settle();
    };

    run.at = (time) => MF.lastAt(epochs.time, time, run.count);
    run.status = (i) => bundle.statuses[epochs.status[i]] ?? "waiting";
    run.pause = Infinity;
    run.isSilentAfter = () => false;
    run.isSilentBetween = () => false;
    run.statusAt = (time) => run.status(run.at(time));
    run.place = (i) => ({ east: epochs.east[i], north: epochs.north[i] });
    run.readingsOf = (i) => rows[i] ?? [];
    run.unusedOf = (i) => unused[i] ?? [];
    run.rowsOf = (x) => reasons[x].rows;
    run.reportAt = (i) => MF.lastReport(run, i);
    run.frameAt = (i) => (frames.length && frames[0].epoch <= i ? frames.findLastIndex((one) => one.epoch <= i) : -1);
    run.frameKey = (frame) => frames[frame];
    // What comes at the place of another fix is another moment; -1 before the first one.
    run.momentKey = (i) => epochs.came[i] ?? -1;
    run.squares = (frame) => frames[frame];
    run.truthAt = () => ({});
    return run;
  };
})();
