"use strict";
// The panel "Why here?": bars in nats, a sentence, the sum.
(() => {
  const AGAINST = { runner: "Runner-up", alt: "Alternative", truth: "Ground truth", place: "Place on the map" };
  const WORDS = { runner: "the runner-up", alt: "the alternative hypothesis", truth: "the true position", place: "the place on the map" };

  const bar = (nats, most) => {
    const half = MF.h("i", { class: nats >= 0 ? "here" : "there", style: { width: `${(48 * Math.abs(nats)) / most}%` } });
    return MF.h("td", { class: "weight", "aria-hidden": "true" }, MF.h("span", { class: "track" }, Number.isFinite(nats) ? half : null));
  };
  const cell = (value, digits = 0) => MF.h("td", {}, MF.number(value, digits));

  const tableOf = (result) => {
    const most = Math.max(0.05, ...result.rows.map((row) => Math.abs(row.nats)).filter(Number.isFinite));
    const bodies = result.rows.map((row) => MF.h("tr", { "data-nats": row.nats },
      MF.h("td", {}, row.name), cell(row.measured), cell(row.here), cell(row.there), bar(row.nats, most),
      MF.h("td", {}, MF.nats(row.nats))));
    return MF.h("div", { class: "scroll" }, MF.h("table", { class: "bars" },
      MF.h("caption", { class: "hidden-visually" }, "Contribution of each reading in nats; positive favours the estimate"),
      MF.h("thead", {}, MF.h("tr", {}, ["Reading", "meas. dBm", "here", "there", "", "nats"].map((words) => MF.h("th", { scope: "col" }, words)))),
      MF.h("tbody", {}, bodies),
      MF.h("tfoot", {}, MF.h("tr", { "data-sum": result.sum }, MF.h("td", { colspan: 5 }, "Sum"), MF.h("td", {}, MF.nats(result.sum))))));
  };

  const verdict = (result) => {
    const side = Math.abs(result.sum) < 0.05 ? "" : result.sum > 0 ? "here" : "there";
    const text = `${result.alone ? "Taken by itself, this report is" : "This report is"} ${MF.times(result.sum)} `
      .replace("likely than ", "likely at the estimate than ").replace("likely as ", "likely at the estimate as ");
    const prior = Number.isFinite(result.prior)
      ? ` Log odds of the estimate against it: ${MF.nats(result.prior, 1)} nats before, ${MF.nats(result.prior + result.sum, 1)} after.` : "";
    const where = result.kind === "place" || result.kind === "truth" ? `at ${WORDS[result.kind]}` : `at ${WORDS[result.kind]}`;
    return MF.h("p", { class: `verdict ${side}` }, `${text}${where}.${prior}`);
  };

  MF.makeWhyPanel = (page) => {
    const body = MF.h("div", {});
    const when = MF.h("span", { class: "quiet" });
    const segments = MF.h("div", { class: "segments", role: "group", "aria-label": "Compare the estimate with" });
    const step = (words, label, by) => MF.h("button", { type: "button", "aria-label": label, title: label, onclick: () => page.stepReport(by) }, words);
    const steps = [step("‹ report", "Previous report used", -1), step("report ›", "Next report used", 1)];
    const clear = MF.h("button", { type: "button", onclick: () => page.store.set({ place: null, against: "runner" }) }, "Clear the place");
    const element = MF.h("section", { class: "card why", "aria-labelledby": "why-title" },
      MF.h("header", {}, MF.h("h2", { id: "why-title" }, "Why here?"), when), segments, body,
      MF.h("div", { class: "steps" }, ...steps, clear));

    const empty = (result, run) => {
      if (result.problem) return result.problem;
      if (!run.count) return "No epoch has come yet.";
      if (result.kind === null && run.reports.length && result.x < 0) return "No radio report has been used yet. Step to the first one with “report ›”.";
      if (!run.explained && !page.bundle.why) {
        if (run.live) return "No reading has been explained since this page was opened.";
        const alone = run.count && run.epochs.hypotheses?.every((one) => !(one > 1));
        return `What readings contribute is recorded for the Bayes map filter only. This run is of the filter “${run.data.filter}”`
          + `${alone ? ", which holds one Gaussian and no second place to compare with" : ""}. Replay the log with --filter bayes --html to compare.`;
      }
      if (!Number.isFinite(run.place(result.epoch).east)) return "There is no estimate at this moment to compare with.";
      return "Nothing to compare with: no second hypothesis is kept. Click on the map to ask why the position is not there.";
    };
    let shown = "";
    element.refresh = (run, i) => {
      const { against, place } = page.store.state;
      const x = run.explained ? run.reportAt(i) : -1;
      const key = JSON.stringify([run.index, x, run.momentKey(x < 0 ? i : run.explained.epoch.raw[x]), against, place, MF.themeName]);
      if (key === shown) return;
      shown = key;
      const result = MF.compare(page, run, i, against, place);
      when.textContent = result.x >= 0 ? `report at ${page.clock(result.time)}` : "";
      segments.replaceChildren(...result.choices.map((name) => MF.h("button", { type: "button",
        "aria-pressed": String(result.kind === name), onclick: () => page.ask(name) }, AGAINST[name])));
      segments.hidden = !result.choices.length;
      clear.hidden = !place;
      for (const one of steps) one.disabled = !run.reports.length;
      if (!result.rows.length) {
        body.replaceChildren(MF.h("p", { class: "empty" }, empty(result, run)));
        return;
      }
      const hint = result.alone ? "This report alone, with nothing known of the cells' errors; the filter also weighs all reports before it." : null;
      body.replaceChildren(verdict(result),
        MF.h("p", { class: "ends", "aria-hidden": "true" }, MF.h("span", { class: "there" }, `◂ for ${WORDS[result.kind]}`), MF.h("span", { class: "here" }, "for the estimate ▸")),
        tableOf(result), hint ? MF.h("p", { class: "quiet" }, hint) : "");
    };
    return element;
  };
})();
