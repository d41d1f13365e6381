"use strict";
// What stays while time runs: streets, buildings, a layer, sites with their sectors, the whole track, the scale bar.
(() => {
  // Width of streets on the map: centre lines are what the database has.
  const STREET_M = 6;

  const picture = (pen, one, alpha = 1) => {
    const { camera, view } = pen;
    pen.image(one.canvas, camera.x(one.west, view), camera.y(one.north, view), one.width * camera.scale,
      one.height * camera.scale, alpha);
  };
  MF.drawPicture = picture;

  const sector = (x, y, azimuth, radius, half) => {
    const points = [[x, y]];
    for (let i = 0; i <= 8; i += 1) {
      const angle = ((azimuth - half + (2 * half * i) / 8) * Math.PI) / 180;
      points.push([x + radius * Math.sin(angle), y - radius * Math.cos(angle)]);
    }
    return points;
  };

  // Sites: a wedge a sector, a ring for cells that have none; the serving cell is filled.
  MF.drawSites = (pen, ground, marks = new Map()) => {
    const { camera, view } = pen;
    const named = new Map();
    ground.cells.forEach((cell, index) => {
      if (!Number.isFinite(cell.east ?? NaN) || !Number.isFinite(cell.north ?? NaN)) return;
      const x = camera.x(cell.east, view);
      const y = camera.y(cell.north, view);
      if (x < -40 || y < -40 || x > view.width + 40 || y > view.height + 40) return;
      const mark = marks.get(index);
      const fill = mark?.fill ?? MF.color.card;
      const style = { fill, stroke: mark ? MF.color.ink : MF.color.soft, width: mark ? 1.6 : 1, alpha: mark ? 1 : 0.85 };
      if (cell.azimuth_deg === null || cell.azimuth_deg === undefined) pen.circle(x, y, 6, style);
      else pen.path(sector(x, y, cell.azimuth_deg, mark ? 21 : 15, 26), style, true);
      const key = `${Math.round(x)} ${Math.round(y)}`;
      if (!named.has(key)) named.set(key, { x, y, words: cell.site || cell.label || cell.id });
    });
    for (const { x, y, words } of named.values()) {
      pen.circle(x, y, 2.5, { fill: MF.color.ink });
      if (named.size < 60 || camera.scale > 0.6) pen.text(words, x + 9, y - 13, { fill: MF.color.ink, halo: MF.color.halo, size: 11, weight: 600 });
    }
  };

  // A track as pieces of one status, each with a dash of its own: status is not told by color alone.
  const DASHES = { SEARCHING: [1.5, 4], UNCERTAIN: [12, 3], LOST: [6, 4], OUTSIDE: [2, 2, 6, 2] };
  // No more than this is gone in a second.
  const LEAP_M = 40;
  MF.dashOf = (status) => DASHES[status] ?? null;
  MF.drawTrack = (pen, run, from, to, style) => {
    const { camera, view } = pen;
    const { east, north, status, time } = run.epochs;
    // Points closer than half a pixel add nothing.
    let points = [];
    let code = -1;
    const flush = () => {
      const name = run.bundle.statuses[code];
      pen.path(points, { ...style, stroke: MF.statusColor(name), dash: MF.dashOf(name) });
    };
    let last = null;
    for (let i = from; i <= to; i += 1) {
      if (!Number.isFinite(east[i]) || !Number.isFinite(north[i])) { flush(); points = []; code = -1; last = null; continue; }
      const point = [camera.x(east[i], view), camera.y(north[i], view)];
      // A leap of the estimate is no movement: the line is cut.
      const leap = last !== null && Math.hypot(east[i] - east[i - 1], north[i] - north[i - 1]) > LEAP_M * Math.max(time[i] - time[i - 1], 1);
      // Where it was in a pause is not known.
      const cut = leap || (last !== null && run.isSilentAfter(i - 1));
      if (status[i] !== code || cut) {
        flush();
        points = cut || !points.length ? [] : [points[points.length - 1]];
        code = status[i];
        last = null;
      }
      if (last === null || Math.abs(point[0] - last[0]) + Math.abs(point[1] - last[1]) > 0.7 || i === to) {
        points.push(point);
        last = point;
      }
    }
    flush();
  };

  MF.drawTruth = (pen, run) => {
    if (!run.hasTruth) return;
    const { camera, view } = pen;
    const points = [];
    let last = null;
    run.truth.east.forEach((east, i) => {
      const point = [camera.x(east, view), camera.y(run.truth.north[i], view)];
      if (point.some((one) => !Number.isFinite(one))) return;
      if (last && Math.abs(point[0] - last[0]) + Math.abs(point[1] - last[1]) < 1) return;
      points.push(point);
      last = point;
    });
    pen.path(points, { stroke: MF.color.halo, width: 8, alpha: 0.9 });
    pen.path(points, { stroke: MF.color.truth, width: 5, alpha: 0.45 });
    if (!points.length) return;
    // The buttons are at the right of the map, where it begins to be read.
    const [x, y] = points[0];
    const left = x > view.width - 100;
    pen.text("start", left ? x - 8 : x + 8, y, { fill: MF.color.ink, align: left ? "right" : "left", halo: MF.color.halo, size: 11 });
  };

  MF.drawScaleBar = (pen, right = 12) => {
    const { camera, view } = pen;
    const most = 130 / camera.scale;
    const power = 10 ** Math.floor(Math.log10(most));
    const length = [5, 2, 1].map((one) => one * power).find((one) => one <= most) ?? power;
    const x1 = view.width - right;
    const x0 = x1 - length * camera.scale;
    const y = view.height - 24;
    pen.path([[x0, y - 4], [x0, y], [x1, y], [x1, y - 4]], { stroke: MF.color.halo, width: 4.5 });
    pen.path([[x0, y - 4], [x0, y], [x1, y], [x1, y - 4]], { stroke: MF.color.ink, width: 1.6 });
    const words = length >= 1000 ? `${length / 1000} km` : `${length} m`;
    pen.text(words, (x0 + x1) / 2, y - 11, { fill: MF.color.ink, halo: MF.color.halo, align: "center", size: 11 });
  };

  MF.drawGround = (pen, { ground, layer, points, run, withSites }) => {
    const { camera, view } = pen;
    pen.rect(0, 0, view.width, view.height, { fill: MF.color.ground });
    if (layer) picture(pen, layer);
    if (ground.buildings) pen.lines(ground.buildings, { fill: MF.color.house, alpha: layer && !layer.plain ? 0.45 : 1 }, true);
    if (points) picture(pen, points, layer && !layer.plain ? 0.35 : 1);
    if (ground.streets) {
      const plain = !layer || layer.plain;
      pen.lines(ground.streets, { stroke: plain ? MF.color.street : MF.color.card, alpha: plain ? 1 : 0.3,
        width: MF.clamp((plain ? STREET_M : 1.2) * camera.scale, 0.6, 24) });
    }
    if (run) {
      MF.drawTruth(pen, run);
      MF.drawTrack(pen, run, 0, run.count - 1, { width: 2, alpha: 0.55 });
    }
    if (withSites) MF.drawSites(pen, ground);
  };
})();
