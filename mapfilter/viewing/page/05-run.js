"use strict";
// A run of the bundle with its arrays read: one row per epoch, ranges of rows for readings and explanations.
(() => {
  const table = (object) => Object.fromEntries(Object.entries(object ?? {}).map(([key, value]) =>
    [key, MF.isArray(value) ? MF.numbers(value) : value]));
  const rows = (object) => Object.fromEntries(Object.entries(object ?? {}).map(([key, value]) =>
    [key, MF.isArray(value) ? MF.array(value) : value]));

  const [PAUSE_S, PAUSES] = [30, 10];
  // A pause between two epochs is longer than this, as in mapfilter.evaluation.outcome.
  const pauseOf = (time, count) => {
    const steps = Array.from({ length: Math.max(count - 1, 0) }, (_, i) => time[i + 1] - time[i]).sort((a, b) => a - b);
    const half = steps.length >> 1;
    const usual = steps.length ? (steps.length % 2 ? steps[half] : (steps[half - 1] + steps[half]) / 2) : 0;
    return Math.max(PAUSE_S, PAUSES * usual);
  };

  // The last explained report at or before an epoch; -1 where there is none.
  MF.lastReport = (run, i) => {
    if (!run.reports.length || run.reportEpochs[0] > i) return -1;
    return run.reports[MF.lastAt(run.reportEpochs, i)];
  };

  MF.makeRun = (data, bundle, index) => {
    const epochs = table(data.epochs);
    const count = data.epochs.count;
    const readings = rows(data.readings);
    const explained = data.explained ? rows(data.explained) : null;
    const belief = data.belief ? rows(data.belief) : null;
    const run = { index, data, bundle, epochs, count, readings, explained, belief, name: data.name,
      unused: data.unused ? rows(data.unused) : null, truth: data.truth ? table(data.truth) : null,
      start: count ? epochs.time[0] : 0, end: count ? epochs.time[count - 1] : 0 };

    run.at = (time) => MF.lastAt(epochs.time, time, count);
    run.status = (i) => bundle.statuses[epochs.status[i]] ?? "?";
    run.pause = pauseOf(epochs.time, count);
    run.isSilentAfter = (i) => i + 1 < count && epochs.time[i + 1] - epochs.time[i] > run.pause;
    run.isSilentBetween = (begin, end) => {
      for (let i = run.at(begin); i + 1 < count && epochs.time[i] < end; i += 1) if (run.isSilentAfter(i)) return true;
      return false;
    };
    // Within a pause the status of the epoch before says nothing.
    run.statusAt = (time) => {
      const i = run.at(time);
      return time > epochs.time[i] && run.isSilentAfter(i) ? "NO DATA" : run.status(i);
    };
    run.place = (i) => ({ east: epochs.east[i], north: epochs.north[i] });
    run.hasTruth = Boolean(run.truth && run.truth.time.length);
    run.readingsOf = (i) => {
      const list = [];
      if (!readings.first) return list;
      for (let r = readings.first.raw[i]; r < readings.first.raw[i + 1]; r += 1) {
        const cell = readings.cell.raw[r];
        const reason = bundle.reasons[readings.use.raw[r]];
        list.push({ cell, role: data.roles[readings.role.raw[r]], what: data.whats[readings.what.raw[r]],
          level: readings.level.at(r), predicted: readings.predicted.at(r), reason, used: reason === "used",
          censored: readings.censored?.raw[r] ?? 0 });
      }
      return list;
    };
    run.unusedOf = (i) => {
      if (!run.unused) return [];
      const { epoch, kind, what, reason, count: times } = run.unused;
      const list = [];
      let r = MF.lastAt(epoch.raw, i - 1) ;
      while (r < epoch.length && epoch.raw[r] < i) r += 1;
      for (; r < epoch.length && epoch.raw[r] === i; r += 1) {
        list.push({ kind: data.kinds[kind.raw[r]], what: data.whats[what.raw[r]],
          reason: bundle.reasons[reason.raw[r]], count: times.raw[r] });
      }
      return list;
    };
    // Explanations that use a report have rows beside the streets.
    run.reports = [];
    if (explained) {
      for (let x = 0; x < explained.epoch.length; x += 1) {
        for (let r = explained.first.raw[x]; r < explained.first.raw[x + 1]; r += 1) {
          if (data.explained.terms[explained.what.raw[r]] !== "streets") { run.reports.push(x); break; }
        }
      }
      run.reportEpochs = run.reports.map((x) => explained.epoch.raw[x]);
    }
    run.reportAt = (i) => MF.lastReport(run, i);
    run.rowsOf = (x) => {
      const list = [];
      for (let r = explained.first.raw[x]; r < explained.first.raw[x + 1]; r += 1) {
        list.push({ term: data.explained.terms[explained.what.raw[r]], cell: explained.cell.raw[r],
          measured: explained.measured.at(r), herePredicted: explained.lead_predicted.at(r),
          runnerPredicted: explained.runner_predicted.at(r), lead: explained.lead.at(r),
          runner: explained.runner.at(r), alt: explained.alt.at(r) });
      }
      return list;
    };
    // Squares of the belief at an epoch: the last frame at or before it.
    run.frameAt = (i) => {
      if (!belief || !belief.epoch.length || belief.epoch.raw[0] > i) return -1;
      return MF.lastAt(belief.epoch.raw, i);
    };
    run.frameKey = (frame) => frame;
    run.momentKey = (i) => i;
    run.squares = (frame) => ({ from: belief.first.raw[frame], to: belief.first.raw[frame + 1], col: belief.col.raw, row: belief.row.raw,
      mass: belief.mass.raw, step: belief.step.at(frame), peak: belief.peak.at(frame) });
    run.truthAt = (i) => ({ east: epochs.truth_east?.[i], north: epochs.truth_north?.[i] });
    return run;
  };
})();
