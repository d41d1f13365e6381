"use strict";
// "Why here?" as rows: what each reading says for the estimate against another place.
(() => {
  const TERMS = { streets: "Streets, motion", serving: "Serving cell", level: "Level", absent: "Cells not reported",
    bound: "Levels as bounds", timing: "Timing advance", fix: "Position fix", gnss: "Satellites", map: "Map", other: "Other readings" };
  const nameOf = (ground, term, cell) => {
    const words = TERMS[term] ?? term;
    return cell >= 0 && (term === "serving" || term === "level" || term === "timing") ? `${words} ${ground.cellName(cell)}` : words;
  };
  const sum = (list) => list.reduce((total, one) => total + one, 0);

  // Which comparisons a moment allows.
  MF.choices = (page, run, i) => {
    const x = run.explained ? run.reportAt(i) : -1;
    const list = [];
    // Outside of the area nothing leads that another place could be compared with.
    const led = x >= 0 && Number.isFinite(run.explained.lead_sum.at(x));
    if (led && Number.isFinite(run.explained.runner_sum.at(x))) list.push("runner");
    if (led && Number.isFinite(run.explained.alt_sum.at(x))) list.push("alt");
    const own = Boolean(page.ground.levels && page.bundle.why);
    const at = x >= 0 ? run.explained.epoch.raw[x] : i;
    const truth = run.truthAt(at);
    if (own && Number.isFinite(truth.east ?? NaN) && Number.isFinite(run.place(at).east)) list.push("truth");
    if (own) list.push("place");
    return list;
  };

  const fromFilter = (page, run, x, key) => {
    const rows = run.rowsOf(x).map((row) => ({ name: nameOf(page.ground, row.term, row.cell), measured: row.measured,
      term: row.term, here: row.herePredicted, there: key === "runner" ? row.runnerPredicted : NaN, nats: row.lead - row[key] }));
    return { rows, sum: run.explained.lead_sum.at(x) - run.explained[`${key}_sum`].at(x),
      prior: key === "runner" ? run.explained.runner_prior.at(x) : NaN, alone: false };
  };

  // The radio report of an epoch in bands of the levels; only what counted.
  const reportOf = (page, run, i) => {
    const { band } = page.ground.levels;
    const used = run.readingsOf(i).filter((one) => one.used && band.has(one.cell));
    // As the filter takes levels: those at an end of the scale are bounds, and of one cell's the first counts.
    const level = new Map();
    for (const one of used) {
      if (Number.isFinite(one.level) && !one.censored && !level.has(one.cell)) level.set(one.cell, one.level);
    }
    const serving = used.find((one) => one.role === "serving");
    return { serving: serving ? band.get(serving.cell) : -1, bands: [...level.keys()].map((cell) => band.get(cell)),
      levels: [...level.values()] };
  };
  MF.reportOf = reportOf;

  const fromPlace = (page, run, i, place) => {
    const { levels, cells } = { levels: page.ground.levels, cells: page.ground.levels.cells };
    const from = run.place(i);
    if (!Number.isFinite(from.east)) return { rows: [], sum: NaN, problem: "There is no estimate at this moment to compare the place with." };
    const here = MF.mapAt(levels, from.east, from.north);
    const there = MF.mapAt(levels, place.east, place.north);
    if (!here || !there) return { rows: [], sum: NaN, problem: there ? "The estimate lies outside the database." : "This place lies outside the database. Choose one on the map's streets." };
    const report = reportOf(page, run, i);
    const a = MF.reportTerms(report, here, page.bundle.why);
    const b = MF.reportTerms(report, there, page.bundle.why);
    let heard = -1;
    const rows = a.map((one, r) => {
      const level = one.term === "level";
      if (level) heard += 1;
      return { name: nameOf(page.ground, one.term, one.band >= 0 ? cells[one.band] : -1), term: one.term,
        measured: level ? report.levels[heard] : NaN, here: one.band >= 0 ? here.level(one.band) : NaN,
        there: one.band >= 0 ? there.level(one.band) : NaN, nats: one.nats - b[r].nats };
    });
    return { rows, sum: sum(rows.map((row) => row.nats)), prior: NaN, alone: true };
  };

  // The comparison of a moment: rows, their sum, the epoch they belong to. Null where no report was explained yet.
  MF.compare = (page, run, i, against, place) => {
    const choices = MF.choices(page, run, i);
    let kind = against === "place" && !place ? null : against;
    if (!choices.includes(kind)) kind = choices.find((one) => one !== "place" || place) ?? null;
    const x = run.explained ? run.reportAt(i) : -1;
    const epoch = x >= 0 ? run.explained.epoch.raw[x] : i;
    const base = { kind, choices, x, epoch, time: run.epochs.time[epoch] };
    if (kind === "runner" || kind === "alt") return { ...base, ...fromFilter(page, run, x, kind) };
    if (kind === "truth") return { ...base, ...fromPlace(page, run, epoch, run.truthAt(epoch)) };
    if (kind === "place") return { ...base, ...fromPlace(page, run, epoch, place) };
    return { ...base, rows: [], sum: NaN };
  };
})();
