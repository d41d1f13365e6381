"use strict";
// Panels of the moment: status and figures, the report's cells, what was not used.
(() => {
  // A panel is built anew only where its epoch has changed.
  const once = (build) => {
    let last = [null, -1, ""];
    return (run, i, status) => {
      const key = run.momentKey(i);
      if (last[0] === run && last[1] === key && last[2] === status) return;
      last = [run, key, status];
      build(run, i, status);
    };
  };
  const pair = (name, value, extra = null) => MF.h("div", {}, MF.h("dt", {}, name), MF.h("dd", {}, value, extra ? MF.h("small", {}, ` ${extra}`) : null));

  MF.makeMomentPanel = (page) => {
    const pill = MF.h("span", { class: "pill", id: "status" });
    const list = MF.h("dl", {});
    const where = MF.h("p", { class: "quiet number" });
    const name = MF.h("p", { class: "quiet", hidden: page.runs.length < 2 });
    const element = MF.h("section", { class: "card moment", "aria-labelledby": "moment-title" },
      MF.h("header", {}, MF.h("h2", { id: "moment-title" }, "This moment"), pill), name, where, list);
    element.refresh = once((run, i, status) => {
      const e = run.epochs;
      pill.textContent = status.toLowerCase();
      pill.style.setProperty("--dot", MF.statusColor(status));
      name.textContent = run.name;
      const here = run.place(i);
      const spot = Number.isFinite(here.east) ? page.ground.lonLat(here.east, here.north) : null;
      const since = status === "NO DATA" ? ` (last position, at ${page.clock(e.time[i])})` : "";
      where.textContent = spot ? `${MF.degrees(spot.lat, spot.lon)}${since}` : "no position yet";
      const way = e.way?.[i] ? page.bundle.background?.ways?.[e.way[i] - 1] : null;
      const items = [
        ["50 % radius", MF.metres(e.r50?.[i])],
        ["95 % radius", MF.metres(e.r95?.[i])],
        ["Protection level", Number.isNaN(e.protection?.[i]) ? "–" : MF.metres(e.protection?.[i])],
        ["Error", run.hasTruth ? MF.metres(e.error[i]) : "no truth"],
        ["Mass within 50 m", MF.share(e.mass?.[i])],
        ["Runner-up", e.runner_mass?.[i] > 0 ? MF.share(e.runner_mass[i]) : "none"],
        ["Entropy", MF.number(e.entropy?.[i], 1, "bit")],
        ["Hypotheses", Number.isFinite(e.hypotheses?.[i]) ? Math.round(e.hypotheses[i]).toLocaleString("en").replaceAll(",", "\u202f") : "–"],
        ["Travelled", MF.metres(e.travelled?.[i])],
        ["Doubt", MF.number(e.doubt?.[i], 1, "nats")],
        ["Matched way", way ? way.name || way.id : "–", way && Number.isFinite(e.way_p[i]) ? MF.share(e.way_p[i]) : null],
        ["Alternative", Number.isFinite(e.alt_lead?.[i]) ? `${MF.nats(e.alt_lead[i], 1)}\u202fnats` : "none"],
      ];
      list.replaceChildren(...items.map((one) => pair(...one)));
    });
    return element;
  };

  MF.makeRadioPanel = (page) => {
    const body = MF.h("div", { class: "scroll" });
    const when = MF.h("span", { class: "quiet" });
    const element = MF.h("section", { class: "card radio", "aria-labelledby": "radio-title" },
      MF.h("header", {}, MF.h("h2", { id: "radio-title" }, "Radio report"), when), body);
    const row = (one) => MF.h("tr", {},
      MF.h("td", {}, one.cell >= 0 ? page.ground.cellName(one.cell) : one.what, one.role === "serving" ? MF.h("small", { class: "quiet" }, " serving") : null),
      MF.h("td", {}, MF.number(one.level, 1)), MF.h("td", {}, MF.number(one.predicted, 1)),
      MF.h("td", {}, MF.nats(one.level - one.predicted, 1)), MF.h("td", { title: page.bundle.words?.[one.reason] ?? one.reason }, one.used ? "used" : "no"));
    element.refresh = once((run, i) => {
      const list = run.readingsOf(i);
      when.textContent = list.length ? `at ${page.clock(run.epochs.time[i])}` : "";
      if (!list.length) {
        body.replaceChildren(MF.h("p", { class: "empty" }, "No radio report at this moment."));
        return;
      }
      body.replaceChildren(MF.h("table", {}, MF.h("thead", {}, MF.h("tr", {},
        ["Cell", "measured dBm", "predicted dBm", "diff. dB", "used"].map((words) => MF.h("th", { scope: "col" }, words)))),
        MF.h("tbody", {}, list.map(row))));
    });
    return element;
  };

  MF.makeUnusedPanel = (page) => {
    const body = MF.h("div", {});
    const element = MF.h("section", { class: "card", "aria-labelledby": "unused-title" }, MF.h("header", {}, MF.h("h2", { id: "unused-title" }, "Not used, and why")), body);
    const sentence = (reason) => page.bundle.words?.[reason] ?? reason.replaceAll("_", " ");
    element.refresh = once((run, i) => {
      const grouped = new Map();
      for (const one of run.readingsOf(i)) {
        if (one.used) continue;
        const names = grouped.get(one.reason) ?? [];
        names.push(one.cell >= 0 ? page.ground.cellName(one.cell) : one.what);
        grouped.set(one.reason, names);
      }
      const lines = [...grouped].map(([reason, names]) => MF.h("li", {}, MF.h("b", {}, names.join(", ")), `: ${sentence(reason)}`));
      for (const one of run.unusedOf(i)) {
        lines.push(MF.h("li", {}, MF.h("b", {}, one.what || one.kind), `${one.count > 1 ? ` (${one.count})` : ""}: ${sentence(one.reason)}`));
      }
      body.replaceChildren(lines.length ? MF.h("ul", { class: "unused" }, lines) : MF.h("p", { class: "empty" }, run.count ? "All readings of this moment were used." : "No epoch has come yet."));
    });
    return element;
  };

  // About the runs: figures and notes.
  MF.fillFacts = (page, host) => {
    if (page.live) {
      const missed = MF.h("p", { class: "quiet", role: "status" });
      page.live.listeners.push(() => {
        const { missed: count } = page.live.run;
        missed.textContent = count ? `${count} fixes came while the connection was cut, and are not kept any more.` : "";
      });
      host.replaceChildren(missed, MF.h("p", { class: "quiet" }, `Shown by mapfilter ${page.bundle.mapfilter} while fixes come in: the last ones that the service keeps, and `
        + `those since the page was opened. ${page.bundle.attribution ?? ""} It asks for nothing but this service.`));
      return;
    }
    const cards = page.runs.map((run) => MF.h("section", { class: "card" }, MF.h("header", {}, MF.h("h2", {}, run.name), MF.h("span", { class: "quiet" }, `${run.count} epochs${run.data.smoothed ? ", smoothed" : ""}`)),
      MF.h("dl", {}, Object.entries(run.data.figures ?? {}).map(([name, value]) => pair(name, value))),
      (run.data.notes ?? []).map((note) => MF.h("p", { class: "quiet" }, note))));
    const notes = (page.bundle.notes ?? []).map((note) => MF.h("p", { class: "quiet" }, note));
    const made = `Made by mapfilter ${page.bundle.mapfilter}. ${page.bundle.attribution ?? ""} Everything is in this file; it asks for nothing from the network.`;
    host.replaceChildren(...cards, ...notes, MF.h("p", { class: "quiet" }, made));
  };
})();
