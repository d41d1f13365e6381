"use strict";
// Pictures made of squares: the belief's density, best server, levels, margin. One pixel a square; the pen enlarges them.
(() => {
  const MOST_PIXELS = 6e6;

  const canvasOf = (cols, rows, paint) => {
    const canvas = document.createElement("canvas");
    canvas.width = cols;
    canvas.height = rows;
    const context = canvas.getContext("2d");
    const image = context.createImageData(cols, rows);
    paint(new Uint32Array(image.data.buffer));
    context.putImageData(image, 0, 0);
    return canvas;
  };
  const packed = ([r, g, b], alpha) => ((Math.round(alpha * 255) << 24) | (b << 16) | (g << 8) | r) >>> 0;

  // A ramp of 256 colors from stops [[at, [r, g, b]], …].
  const ramp = (stops, alpha = 1) => {
    const table = new Uint32Array(256);
    for (let i = 0; i < 256; i += 1) {
      const t = i / 255;
      let s = 0;
      while (s + 2 < stops.length && t > stops[s + 1][0]) s += 1;
      const [t0, a] = stops[s];
      const [t1, b] = stops[s + 1];
      const u = MF.clamp((t - t0) / (t1 - t0), 0, 1);
      table[i] = packed(a.map((one, k) => Math.round(one + u * (b[k] - one))), typeof alpha === "number" ? alpha : alpha(t));
    }
    return table;
  };
  // Viridis, in seven stops: even steps of lightness, read alike by all kinds of color vision.
  const VIRIDIS = [[0, [68, 1, 84]], [0.17, [70, 50, 126]], [0.33, [54, 92, 141]], [0.5, [39, 127, 142]],
    [0.67, [31, 161, 135]], [0.83, [110, 206, 88]], [1, [253, 231, 37]]];

  // The belief of a frame: darker where more mass is; the square root makes a hundredth of the peak visible.
  MF.makeDensity = () => {
    let last = { run: null, key: null, theme: "", picture: null };
    return (run, frame) => {
      if (frame < 0) return null;
      const key = run.frameKey(frame);
      if (last.run === run && last.key === key && last.theme === MF.themeName) return last.picture;
      const { from, to, col, row, mass, step } = run.squares(frame);
      let [c0, c1, r0, r1] = [Infinity, -Infinity, Infinity, -Infinity];
      for (let i = from; i < to; i += 1) {
        c0 = Math.min(c0, col[i]); c1 = Math.max(c1, col[i]);
        r0 = Math.min(r0, row[i]); r1 = Math.max(r1, row[i]);
      }
      let picture = null;
      // Squares that lie too far apart for one picture are put into coarser ones.
      const coarse = to > from ? Math.max(1, Math.ceil(Math.sqrt(((c1 - c0 + 1) * (r1 - r0 + 1)) / MOST_PIXELS))) : 1;
      if (to > from) {
        const cols = Math.floor((c1 - c0) / coarse) + 1;
        const rows = Math.floor((r1 - r0) / coarse) + 1;
        const hue = MF.rgb(MF.color.belief);
        const table = ramp([[0, hue], [1, hue]], (t) => 0.1 + 0.85 * t);
        const canvas = canvasOf(cols, rows, (pixels) => {
          for (let i = from; i < to; i += 1) {
            const at = (rows - 1 - Math.floor((row[i] - r0) / coarse)) * cols + Math.floor((col[i] - c0) / coarse);
            const color = table[mass[i]];
            if (color > pixels[at]) pixels[at] = color;
          }
        });
        const wide = step * coarse;
        picture = { canvas, west: c0 * step, north: r0 * step + rows * wide, width: cols * wide, height: rows * wide,
          squares: to - from, step };
      }
      last = { run, key, theme: MF.themeName, picture };
      return picture;
    };
  };

  const spread = (array, from, count) => {
    let [low, high] = [Infinity, -Infinity];
    for (let i = from; i < from + count; i += 1) {
      const value = array.at(i);
      if (value < low) low = value;
      if (value > high) high = value;
    }
    return high > low ? [low, high] : [Number.isFinite(low) ? low - 1 : 0, Number.isFinite(low) ? low + 1 : 1];
  };
  const shaded = (grid, array, from, [low, high]) => {
    const table = ramp(VIRIDIS, 0.85);
    const canvas = canvasOf(grid.cols, grid.rows, (pixels) => {
      for (let i = 0; i < pixels.length; i += 1) {
        const value = array.at(from + i);
        if (Number.isFinite(value)) pixels[i] = table[high > low ? Math.round(255 * MF.clamp((value - low) / (high - low), 0, 1)) : 128];
      }
    });
    return placed(canvas, grid);
  };
  const placed = (canvas, grid) => ({ canvas, west: grid.west, north: grid.north, width: grid.cols * grid.step,
    height: grid.rows * grid.step });

  const bestServer = (best) => {
    const { rows, cols } = best.grid;
    const server = best.server.raw;
    const canvas = canvasOf(cols, rows, (pixels) => {
      for (let i = 0; i < pixels.length; i += 1) {
        if (server[i] >= 0) pixels[i] = packed(MF.cellRgb(server[i]), 0.75);
      }
    });
    return placed(canvas, best.grid);
  };

  MF.VIRIDIS_CSS = `linear-gradient(90deg, ${VIRIDIS.map(([t, c]) => `${MF.css(c)} ${100 * t}%`).join(", ")})`;

  // The layer under the tracks: its picture, its title and its scale for the legend.
  MF.makeLayers = (ground) => {
    const kept = new Map();
    const make = (name, cell) => {
      if (name === "none") return { ...MF.areaPicture(ground.best), plain: true };
      if (name === "best" && ground.best) {
        const seen = [...new Set(ground.best.server.raw)].filter((one) => one >= 0).sort((a, b) => a - b);
        return { ...bestServer(ground.best), title: "Best server",
          swatches: seen.map((one) => ({ name: ground.cellName(one), color: MF.css(MF.cellRgb(one)) })) };
      }
      if (name === "strength" && ground.best) {
        const range = spread(ground.best.level, 0, ground.best.level.length);
        return { ...shaded(ground.best.grid, ground.best.level, 0, range), title: "Level of the best server", range, unit: "dBm" };
      }
      if (name === "margin" && ground.best) {
        const range = [0, Math.min(spread(ground.best.margin, 0, ground.best.margin.length)[1], 20)];
        return { ...shaded(ground.best.grid, ground.best.margin, 0, range), title: "Margin of the best over the second", range, unit: "dB" };
      }
      if (name === "level" && ground.levels?.band.has(cell)) {
        const from = ground.levels.band.get(cell) * ground.levels.size;
        const range = spread(ground.levels.level, from, ground.levels.size);
        return { ...shaded(ground.levels.grid, ground.levels.level, from, range), title: `Predicted level of ${ground.cellName(cell)}`, range, unit: "dBm" };
      }
      const bound = name === "bound" ? ground.bounds[cell] : null;
      if (bound) return { ...shaded(bound.grid, bound.value, 0, bound.range), title: bound.name, range: bound.range, unit: bound.unit };
      return null;
    };
    return (name, cell) => {
      if (name === "none" && !ground.best) return null;
      const key = `${name} ${name === "level" || name === "bound" ? cell : ""} ${MF.themeName}`;
      if (!kept.has(key)) {
        if (kept.size > 40) kept.clear();
        kept.set(key, make(name, cell));
      }
      return kept.get(key);
    };
  };

  // Where the database has points: the ground under the streets.
  MF.areaPicture = (best) => {
    const rgb = MF.rgb(MF.color.building);
    const canvas = canvasOf(best.grid.cols, best.grid.rows, (pixels) => {
      for (let i = 0; i < pixels.length; i += 1) if (best.server.raw[i] >= 0) pixels[i] = packed(rgb, 1);
    });
    return placed(canvas, best.grid);
  };

  // The database's points as one picture, drawn where there are no streets, and as a layer of their own.
  MF.pointsPicture = (points) => {
    const { grid, bits } = points;
    const [r, g, b] = MF.rgb(MF.color.street);
    const canvas = canvasOf(grid.cols, grid.rows, (pixels) => {
      for (let i = 0; i < pixels.length; i += 1) {
        if ((bits[i >> 3] >> (7 - (i & 7))) & 1) pixels[i] = packed([r, g, b], 0.9);
      }
    });
    return placed(canvas, grid);
  };
})();
