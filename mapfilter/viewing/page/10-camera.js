"use strict";
// Where the maps look: a center in metres and a scale in pixels per metre, shared by all maps.
(() => {
  const BUTTONS = 56;

  MF.makeCamera = (changed) => {
    const camera = { east: 0, north: 0, scale: 1, least: 0.001, most: 40, moved: false };
    camera.x = (east, view) => (east - camera.east) * camera.scale + view.width / 2;
    camera.y = (north, view) => view.height / 2 - (north - camera.north) * camera.scale;
    camera.eastOf = (x, view) => (x - view.width / 2) / camera.scale + camera.east;
    camera.northOf = (y, view) => (view.height / 2 - y) / camera.scale + camera.north;
    camera.fit = (box, view) => {
      const width = Math.max(box.east1 - box.east0, 40);
      const height = Math.max(box.north1 - box.north0, 40);
      // Room for the buttons at the right, twice, so that the middle stays the middle.
      const across = Math.max(view.width - 2 * BUTTONS, 0.6 * view.width);
      camera.east = (box.east0 + box.east1) / 2;
      camera.north = (box.north0 + box.north1) / 2;
      camera.scale = MF.clamp(Math.min(across / width, (0.88 * view.height) / height), camera.least, camera.most);
      changed();
    };
    camera.pan = (dx, dy) => {
      camera.moved = true;
      camera.east -= dx / camera.scale;
      camera.north += dy / camera.scale;
      changed();
    };
    // Zoom with the place under (x, y) kept where it is.
    camera.zoom = (factor, x, y, view) => {
      camera.moved = true;
      const east = camera.eastOf(x, view);
      const north = camera.northOf(y, view);
      camera.scale = MF.clamp(camera.scale * factor, camera.least, camera.most);
      camera.east = east - (x - view.width / 2) / camera.scale;
      camera.north = north + (y - view.height / 2) / camera.scale;
      changed();
    };
    camera.goTo = (east, north) => {
      camera.east = east;
      camera.north = north;
      changed();
    };
    return camera;
  };

  // What a run covers: its truth and its estimates, else the area.
  // What there is to see: the runs, or else the streets, or the squares where a cell is received.
  MF.boxOfRuns = (runs, frame, ground) => {
    const box = { east0: Infinity, east1: -Infinity, north0: Infinity, north1: -Infinity };
    const add = (east, north) => {
      if (!Number.isFinite(east) || !Number.isFinite(north)) return;
      box.east0 = Math.min(box.east0, east);
      box.east1 = Math.max(box.east1, east);
      box.north0 = Math.min(box.north0, north);
      box.north1 = Math.max(box.north1, north);
    };
    for (const run of runs) {
      for (let i = 0; i < run.count; i += 1) add(run.epochs.east[i], run.epochs.north[i]);
      if (run.hasTruth) run.truth.east.forEach((east, i) => add(east, run.truth.north[i]));
    }
    if (!Number.isFinite(box.east0)) ground.streets?.east.forEach((east, i) => add(east, ground.streets.north[i]));
    if (!Number.isFinite(box.east0) && ground.best) {
      const { grid, server } = ground.best;
      server.raw.forEach((one, i) => {
        if (one >= 0) add(grid.west + (i % grid.cols + 0.5) * grid.step, grid.north - (Math.floor(i / grid.cols) + 0.5) * grid.step);
      });
    }
    if (!Number.isFinite(box.east0)) return { east0: 0, north0: 0, east1: frame.size[0], north1: frame.size[1] };
    return box;
  };
})();
