"use strict";
// The area: streets, buildings, best server, predicted levels, and what they are at a place.
(() => {
  // Margin that stands for "no second cell", dB.
  const ALONE_DB = 63;
  const pixel = (grid, east, north) => {
    const col = Math.floor((east - grid.west) / grid.step);
    const row = Math.floor((grid.north - north) / grid.step);
    return col < 0 || row < 0 || col >= grid.cols || row >= grid.rows ? -1 : row * grid.cols + col;
  };

  const lines = (object) => {
    if (!object || !object.first) return null;
    const first = MF.array(object.first).raw;
    if (first.length < 2) return null;
    return { first, east: MF.numbers(object.east), north: MF.numbers(object.north), path: null };
  };

  MF.makeGround = (bundle) => {
    const background = bundle.background ?? {};
    const ground = { frame: bundle.frame, cells: bundle.cells, streets: lines(background.streets),
      buildings: lines(background.buildings), points: null, best: null, bounds: [], levels: null };
    if (background.points) ground.points = { grid: background.points.grid, bits: MF.array(background.points.bits).raw };
    if (background.best) {
      const { grid, server, level, margin } = background.best;
      ground.best = { grid, server: MF.array(server), level: MF.array(level), margin: MF.array(margin) };
    }
    ground.bounds = (background.bound ?? []).map((one) => ({ ...one, value: MF.array(one.value) }));
    if (bundle.levels) {
      const { grid, level, rough, best, second, distance } = bundle.levels;
      ground.levels = { ...bundle.levels, level: MF.array(level), rough: MF.array(rough), best: MF.array(best),
        second: MF.array(second), distance: MF.array(distance), size: grid.rows * grid.cols,
        band: new Map(bundle.levels.cells.map((cell, band) => [cell, band])) };
    }
    // The pieces of one way, kept for the last one asked for: it changes seldom.
    const owners = background.streets?.way ? MF.array(background.streets.way).raw : null;
    let wayKept = { index: -1, set: null };
    ground.wayLines = (index) => {
      if (!owners || !ground.streets) return null;
      if (wayKept.index === index) return wayKept.set;
      const { first, east, north } = ground.streets;
      const [firsts, easts, norths] = [[0], [], []];
      for (let l = 0; l + 1 < first.length; l += 1) {
        if (owners[l] !== index) continue;
        for (let i = first[l]; i < first[l + 1]; i += 1) {
          easts.push(east[i]);
          norths.push(north[i]);
        }
        firsts.push(easts.length);
      }
      wayKept = { index, set: easts.length ? { first: firsts, east: easts, north: norths, path: null } : null };
      return wayKept.set;
    };

    // Predicted levels at a place, strongest first; empty where the database has none.
    ground.levelsAt = (east, north) => {
      const all = ground.levels;
      if (!all) return [];
      const at = pixel(all.grid, east, north);
      if (at < 0) return [];
      return all.cells.map((cell, band) => ({ cell, level: all.level.at(band * all.size + at) }))
        .filter((one) => Number.isFinite(one.level)).sort((a, b) => b.level - a.level);
    };
    ground.bestAt = (east, north) => {
      const one = ground.best;
      if (!one) return null;
      const at = pixel(one.grid, east, north);
      if (at < 0 || one.server.raw[at] < 0) return null;
      const margin = one.margin.at(at);
      return { cell: one.server.raw[at], level: one.level.at(at), margin: margin < ALONE_DB ? margin : Infinity };
    };
    // What the bounds say of a place.
    ground.boundsAt = (east, north) => ground.bounds.map((one) => ({ ...one, at: one.value.at(pixel(one.grid, east, north)) }))
      .filter((one) => Number.isFinite(one.at));
    // Longitude and latitude by the frame's corners (bilinear: for labels).
    ground.lonLat = (east, north) => {
      const { corners, size } = bundle.frame;
      if (!corners || !(size[0] > 0 && size[1] > 0)) return null;
      const [u, v] = [east / size[0], north / size[1]];
      // Longitudes go on across 180 degrees.
      const near = (one, k) => (k ? one : one - 360 * Math.round((one - corners[0][0]) / 360));
      const [sw, se, ne, nw] = corners.map((one) => one.map(near));
      const mix = (k) => (1 - v) * ((1 - u) * sw[k] + u * se[k]) + v * ((1 - u) * nw[k] + u * ne[k]);
      const lon = mix(0);
      return { lon: lon - 360 * Math.round(lon / 360), lat: mix(1) };
    };
    ground.cellName = (cell) => ground.cells[cell]?.label || ground.cells[cell]?.id || "unknown cell";
    return ground;
  };
})();
