"use strict";
// Puts the parts together: one state, one loop that draws what has changed.
(() => {
  const [SIDE_MS, GROW_MS, CHARTS_MS] = [160, 200, 1000];

  const makePage = (bundle, live) => {
    const ground = MF.makeGround(bundle);
    const runs = live ? [live.run] : (bundle.runs ?? []).map((run, index) => MF.makeRun(run, bundle, index)).filter((run) => run.count > 0);
    runs.forEach((run, index) => { run.index = index; });
    const start = Math.min(...runs.map((run) => run.start));
    const end = Math.max(...runs.map((run) => run.end));
    const page = { bundle, ground, runs, live, start: runs.length ? start : 0, end: runs.length ? end : 0, maps: [] };
    page.store = MF.store({ time: page.start, playing: false, speed: 10, follow: Boolean(live), run: 0, second: runs.length > 1 ? 1 : -1, place: null, against: "runner",
      layer: runs.length || !ground.best ? "none" : "best", layerCell: -1, show: { belief: true, regions: true, hypotheses: true, radio: true } });
    const redrawAll = () => { for (const map of page.maps) map.dirty = true; page.stale = true; };
    page.camera = MF.makeCamera(redrawAll);
    page.redrawAll = redrawAll;
    page.layers = MF.makeLayers(ground);
    let points = null;
    page.points = () => {
      if (points?.theme !== MF.themeName) points = { theme: MF.themeName, ...MF.pointsPicture(ground.points) };
      return points;
    };
    page.active = () => runs[page.store.state.run];
    // Times are shown since the start of the first run.
    page.clock = (time) => MF.clock(time - page.start);
    // Who looks back does not want to be taken away from there by what comes in.
    page.seek = (time) => page.store.set({ time: MF.clamp(time, page.start, page.end), follow: Boolean(live) && time >= page.end });
    page.step = (by) => {
      const { time } = page.store.state;
      const run = page.active();
      if (!run.count) return;
      page.store.set({ playing: false });
      page.seek(run.epochs.time[MF.clamp(run.at(time) + by, 0, run.count - 1)]);
    };
    page.stepReport = (by) => {
      const run = page.active();
      const i = run.at(page.store.state.time);
      const next = by > 0 ? run.reportEpochs?.find((one) => one > i) : run.reportEpochs?.findLast((one) => one < i);
      page.store.set({ playing: false });
      if (next !== undefined) page.seek(run.epochs.time[next]);
    };
    page.follow = (follow) => {
      page.store.set({ follow, playing: false });
      if (follow) page.seek(page.end);
    };
    page.play = (playing) => {
      if (!page.active().count) return;
      if (playing && page.store.state.time >= page.end) page.seek(page.start);
      page.store.set(playing ? { playing, follow: false } : { playing });
    };
    page.ask = (against) => {
      if (against === "place" && !page.store.state.place) {
        const { camera } = page;
        page.store.set({ place: { east: camera.east, north: camera.north }, against });
        MF.say("Place set at the map's center. Click on the map to choose another.");
      } else page.store.set({ against });
    };
    page.fit = () => page.camera.fit(MF.boxOfRuns(runs, bundle.frame, ground), page.maps[0].view);
    page.center = () => {
      const here = page.active().place(page.active().at(page.store.state.time));
      if (Number.isFinite(here.east)) page.camera.goTo(here.east, here.north);
    };
    return page;
  };

  const buildMaps = (page) => {
    const stage = MF.byId("stage");
    const { run, second } = page.store.state;
    const shown = page.runs.length ? [...new Set([run === second ? 0 : run, second].filter((one) => one >= 0))] : [null];
    if (page.runs.length && run === second && run !== 0) shown[0] = 0;
    page.maps = shown.map((index) => MF.makeMap(page, index === null ? null : page.runs[index], shown.length > 1));
    stage.replaceChildren(...page.maps.map((map) => map.element));
    page.maps.forEach((map) => { map.resize(); map.refreshLegend(); });
  };
  const markActive = (page) => page.maps.forEach((map) => { map.element.dataset.active = String(page.maps.length > 1 && map.run?.index === page.store.state.run); });

  const announce = (page, before) => {
    const run = page.active();
    const i = run.at(page.store.state.time);
    const status = run.statusAt(page.store.state.time);
    if (status !== before) MF.say(`${page.clock(page.store.state.time)}: ${status.toLowerCase()}, 95 % radius ${MF.metres(run.epochs.r95?.[i])}`);
    return status;
  };

  const start = (bundle, live = null) => {
    const page = makePage(bundle, live);
    MF.page = page;
    const replay = page.runs.length > 0;
    document.body.dataset.kind = replay ? "replay" : "database";
    MF.byId("title").textContent = document.title = bundle.title;
    MF.byId("subtitle").textContent = live ? bundle.place : replay ? page.runs.map((run) => run.name).join(" · ") : `${bundle.cells.length} cells`;
    if (!live) page.store.set(MF.readAddress(page));
    MF.makeTools(page, MF.byId("tools"));
    MF.fillFacts(page, MF.byId("facts"));
    let panels = [];
    let charts = null;
    let player = null;
    let database = null;
    if (replay) {
      panels = [MF.makeMomentPanel(page), MF.makeWhyPanel(page), MF.makeRadioPanel(page), MF.makeUnusedPanel(page)];
      MF.byId("side").replaceChildren(...panels);
      player = MF.makePlayer(page, MF.byId("transport"));
      charts = MF.makeCharts(page, MF.byId("charts"));
    } else {
      database = MF.makeDatabasePanels(page);
      MF.byId("side").replaceChildren(...database.elements);
      MF.byId("charts").hidden = true;
      database.refresh();
    }
    // The maps fill what the bar and the transport leave of the window.
    const measure = () => {
      const chrome = document.querySelector(".bar").offsetHeight + MF.byId("transport").offsetHeight;
      document.documentElement.style.setProperty("--chrome", `${chrome}px`);
    };

    measure();
    buildMaps(page);
    markActive(page);
    page.fit();
    charts?.build();
    player?.strip();

    let status = replay ? page.active().statusAt(page.store.state.time) : "";
    let sideAt = 0;
    let sideStale = true;
    const refreshSide = () => {
      sideStale = false;
      sideAt = performance.now();
      if (!replay) { database.refresh(); return; }
      const run = page.active();
      const { time } = page.store.state;
      const i = run.at(time);
      for (const panel of panels) panel.refresh(run, i, run.statusAt(time));
      charts.refresh(page.store.state.time);
      status = announce(page, status);
      if (!live && !page.store.state.playing) MF.writeAddress(page);
    };
    page.store.listen((changed) => {
      page.stale = true;
      sideStale = true;
      if (changed.has("second") || (changed.has("run") && !page.maps.some((map) => map.run?.index === page.store.state.run))) buildMaps(page);
      if (changed.has("run")) { charts?.build(); player?.strip(); }
      if (changed.has("run") || changed.has("second")) markActive(page);
      if (changed.has("layer") || changed.has("layerCell")) page.maps.forEach((map) => { map.dirty = true; map.refreshLegend(); });
    });
    MF.onTheme(() => {
      page.redrawAll();
      page.maps.forEach((map) => map.refreshLegend());
      charts?.build();
      player?.strip();
      sideStale = true;
      draw(performance.now());
    });
    if (!live) window.addEventListener("hashchange", () => page.store.set(MF.readAddress(page)));
    window.addEventListener("resize", () => {
      measure();
      page.maps.forEach((map) => map.resize());
      charts?.resize();
      player?.strip();
      page.stale = true;
      sideStale = true;
    });
    MF.listenToKeys(page);

    const stats = { frames: 0, draw_ms: 0, since: performance.now() };
    MF.stats = stats;
    let [grown, grownAt, chartsStale, chartsAt] = [false, 0, false, 0];
    live?.listeners.push(() => { grown = true; });
    const grow = (now) => {
      if (grown && now - grownAt > GROW_MS) {
        [grown, grownAt, chartsStale, sideStale] = [false, now, true, true];
        MF.growPage(page);
        player.strip();
      }
      if (chartsStale && now - chartsAt > CHARTS_MS) {
        [chartsStale, chartsAt] = [false, now];
        charts.grow();
        sideStale = true;
      }
    };
    const draw = (now) => {
      if (live) grow(now);
      if (page.stale) {
        page.stale = false;
        const from = performance.now();
        for (const map of page.maps) map.draw();
        player?.refresh();
        stats.draw_ms += performance.now() - from;
        stats.frames += 1;
      }
      // The panels are for reading: they follow some six times a second.
      if (sideStale && (!page.store.state.playing || now - sideAt > SIDE_MS)) refreshSide();
    };
    let last = null;
    const tick = (now) => {
      const { playing, time, speed } = page.store.state;
      if (playing) {
        const next = time + (last === null ? 0 : ((now - last) / 1000) * speed);
        page.store.set(next >= page.end ? { time: page.end, playing: false } : { time: next });
        last = now;
      } else last = null;
      draw(now);
      requestAnimationFrame(tick);
    };
    page.stale = true;
    requestAnimationFrame(tick);
    MF.ready = performance.now();
    document.documentElement.dataset.ready = "true";
  };

  const fail = (error) => {
    MF.byId("stage").replaceChildren(MF.h("p", { class: "failure", role: "alert" }, `This page could not be opened.\n${error.message}`));
    document.documentElement.dataset.ready = "failed";
  };
  MF.startTheme();
  const opened = MF.byId("mapfilter-bundle") ? MF.readBundle().then((bundle) => start(bundle)) : MF.openLive(start);
  opened.catch((error) => { fail(error); console.error(error); });
})();
