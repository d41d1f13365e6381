"use strict";
// What new fixes change of an open page: its end, the moment shown, where the map looks, the legend.
(() => {
  const INNER = 0.35;
  const AROUND_M = 250;

  // Keeps the estimate in the middle part of the map; a map that was moved elsewhere stays there.
  const lookAt = (page, here, before) => {
    const { camera } = page;
    const { view } = page.maps[0];
    const inside = (one) => Math.abs(camera.x(one.east, view) - view.width / 2) < INNER * view.width
      && Math.abs(camera.y(one.north, view) - view.height / 2) < INNER * view.height;
    if (!inside(here) && (!before || inside(before))) camera.goTo(here.east, here.north);
  };

  MF.growPage = (page) => {
    const { run } = page.live;
    const { follow, time } = page.store.state;
    page.start = run.start;
    page.end = run.end;
    const last = run.count - 1;
    const here = run.place(last);
    if (follow && last >= 0) {
      page.store.set({ time: page.end });
      const known = Number.isFinite(here.east);
      const found = ["CONVERGED", "TRACKING", "UNCERTAIN"].includes(run.status(last));
      if (known && found && !page.camera.moved) {
        const wide = Math.max(AROUND_M, 4 * (run.epochs.r95[last] || 0));
        page.camera.fit({ east0: here.east - wide, east1: here.east + wide, north0: here.north - wide, north1: here.north + wide }, page.maps[0].view);
        page.camera.moved = true;
      } else if (known && found) lookAt(page, here, page.lookedAt);
      page.lookedAt = known ? here : null;
    } else if (time < page.start) page.store.set({ time: page.start });
    const signs = JSON.stringify([[...new Set(run.epochs.status)], Boolean(run.belief), ["protection", "alt_lead"].map((key) => run.epochs[key].some(Number.isFinite)),
      ["way", "runner_mass"].map((key) => run.epochs[key].some((one) => one > 0))]);
    if (signs !== page.signs) page.maps.forEach((map) => map.refreshLegend());
    page.signs = signs;
    page.redrawAll();
  };
})();
