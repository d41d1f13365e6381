"use strict";
// What moves with time: belief, regions, hypotheses, serving cell and neighbours, the places compared.
(() => {
  const known = (place) => Number.isFinite(place.east) && Number.isFinite(place.north);
  const TRAIL = 90;

  // Words beside a mark: at its right, or at its left where the map ends or another mark is.
  const label = (pen, words, x, y, fill, taken = false) => {
    const left = taken || x > pen.view.width - 12 - 8 * words.length;
    pen.text(words, left ? x - 15 : x + 11, y, { fill, align: left ? "right" : "left", halo: MF.color.halo, size: 12, weight: 650 });
  };

  const links = (pen, ground, readings, from) => {
    const { camera, view } = pen;
    const marks = new Map();
    for (const one of readings) {
      const cell = ground.cells[one.cell];
      if (!cell) continue;
      const serving = one.role === "serving";
      if (serving || !marks.has(one.cell)) marks.set(one.cell, { fill: serving ? MF.color.accent : MF.color.line });
      if (!Number.isFinite(cell.east ?? NaN) || !from) continue;
      const strength = Number.isFinite(one.level) ? MF.clamp((one.level + 110) / 60, 0.1, 1) : 0.3;
      pen.path([[camera.x(cell.east, view), camera.y(cell.north, view)], [camera.x(from.east, view), camera.y(from.north, view)]],
        { stroke: serving ? MF.color.accent : MF.color.soft, width: serving ? 2 : 1, alpha: serving ? 0.8 : 0.2 + 0.4 * strength,
          dash: serving ? null : [3, 4] });
    }
    return marks;
  };

  MF.drawMoment = (pen, { ground, run, i, status: name, density, place, show }) => {
    const { camera, view } = pen;
    const { color } = MF;
    const at = (one) => [camera.x(one.east, view), camera.y(one.north, view)];
    const e = run.epochs;
    const here = run.place(i);
    const way = e.way?.[i] > 0 && show.hypotheses ? ground.wayLines(e.way[i] - 1) : null;
    if (way) pen.lines(way, { stroke: color.accent, alpha: 0.3, width: MF.clamp(5 * camera.scale, 2, 20) });
    if (show.belief && density) MF.drawPicture(pen, density);
    MF.drawTrack(pen, run, Math.max(0, i - TRAIL), i, { width: 4, alpha: 1 });

    const readings = run.readingsOf(i);
    const marks = show.radio ? links(pen, ground, readings, known(here) ? here : null) : new Map();
    MF.drawSites(pen, ground, marks);

    const truth = run.truthAt(i);
    if (known(truth)) {
      const [tx, ty] = at(truth);
      if (known(here)) pen.path([at(here), [tx, ty]], { stroke: color.truth, width: 1, dash: [2, 2] });
      pen.path([[tx, ty - 8], [tx + 8, ty], [tx, ty + 8], [tx - 8, ty]], { fill: color.card, stroke: color.truth, width: 2.4 }, true);
    }
    if (known(here)) {
      const [x, y] = at(here);
      const status = MF.statusColor(name);
      if (show.regions) {
        if (Number.isFinite(e.protection?.[i])) pen.circle(x, y, e.protection[i] * camera.scale, { stroke: color.ink, width: 1.2, dash: [2, 5], alpha: 0.7 });
        if (Number.isFinite(e.r95?.[i])) pen.circle(x, y, e.r95[i] * camera.scale, { stroke: status, width: 1.8 });
        if (Number.isFinite(e.r50?.[i])) {
          pen.circle(x, y, e.r50[i] * camera.scale, { fill: status, alpha: 0.16 });
          pen.circle(x, y, e.r50[i] * camera.scale, { stroke: status, width: 1.2, dash: [5, 3] });
        }
      }
      let taken = false;
      const runner = { east: e.runner_east?.[i], north: e.runner_north?.[i] };
      if (show.hypotheses && known(runner) && e.runner_mass[i] > 0) {
        const [rx, ry] = at(runner);
        pen.rect(rx - 7, ry - 7, 14, 14, { fill: color.card, stroke: color.there, width: 2.6 });
        // Close marks have their words on the sides that look away from each other.
        const close = Math.abs(rx - x) < 90 && Math.abs(ry - y) < 18;
        taken = close && rx >= x;
        label(pen, MF.share(e.runner_mass[i]), rx, ry, color.there, close && !taken);
      }
      const other = { east: e.alt_east?.[i], north: e.alt_north?.[i] };
      if (show.hypotheses && known(other)) {
        const [ax, ay] = at(other);
        pen.path([[ax, ay - 9], [ax + 9, ay + 7], [ax - 9, ay + 7]], { fill: color.card, stroke: color.alternative, width: 2.6 }, true);
        label(pen, `alternative ${MF.nats(e.alt_lead[i], 1)} nats`, ax, ay, color.alternative);
      }
      pen.circle(x, y, 8, { fill: status, stroke: color.card, width: 2.5 });
      pen.circle(x, y, 9.5, { stroke: color.ink, width: 1 });
      if (show.hypotheses) label(pen, MF.share(e.mass?.[i]), x + 2, y, color.ink, taken);
    }
    if (place) MF.drawPlace(pen, place);
  };

  // The place that somebody pointed at.
  MF.drawPlace = (pen, place, words = "there") => {
    const x = pen.camera.x(place.east, pen.view);
    const y = pen.camera.y(place.north, pen.view);
    for (const [stroke, width] of [[MF.color.halo, 6], [MF.color.there, 3]]) {
      pen.path([[x - 8, y - 8], [x + 8, y + 8]], { stroke, width });
      pen.path([[x - 8, y + 8], [x + 8, y - 8]], { stroke, width });
    }
    pen.text(words, x + 13, y, { fill: MF.color.there, halo: MF.color.halo, size: 12, weight: 650 });
  };
})();
