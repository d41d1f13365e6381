"use strict";
// Two pens with the same strokes: one draws on a canvas, one writes SVG. The scene knows neither.
(() => {
  MF.canvasPen = (context, camera, view) => {
    const style = (s) => {
      context.globalAlpha = s.alpha ?? 1;
      context.lineWidth = s.width ?? 1;
      context.lineJoin = "round";
      context.lineCap = s.dash ? "butt" : "round";
      context.setLineDash(s.dash ?? []);
      if (s.stroke) context.strokeStyle = s.stroke;
      if (s.fill) context.fillStyle = s.fill;
    };
    const finish = (s) => {
      if (s.fill) context.fill();
      if (s.stroke) context.stroke();
      context.globalAlpha = 1;
    };
    return {
      view, camera,
      rect(x, y, width, height, s) { style(s); context.beginPath(); context.rect(x, y, width, height); finish(s); },
      circle(x, y, r, s) { style(s); context.beginPath(); context.arc(x, y, Math.max(r, 0), 0, 2 * Math.PI); finish(s); },
      path(points, s, closed = false) {
        if (points.length < 2) return;
        style(s);
        context.beginPath();
        points.forEach(([x, y], i) => (i ? context.lineTo(x, y) : context.moveTo(x, y)));
        if (closed) context.closePath();
        finish(s);
      },
      // Many polylines of the ground: kept as one path in metres.
      lines(set, s, closed = false) {
        if (!set.path) {
          set.path = new Path2D();
          for (let l = 0; l + 1 < set.first.length; l += 1) {
            for (let i = set.first[l]; i < set.first[l + 1]; i += 1) {
              if (i === set.first[l]) set.path.moveTo(set.east[i], set.north[i]);
              else set.path.lineTo(set.east[i], set.north[i]);
            }
            if (closed) set.path.closePath();
          }
        }
        style({ ...s, width: (s.width ?? 1) / camera.scale });
        context.save();
        context.translate(view.width / 2, view.height / 2);
        context.scale(camera.scale, -camera.scale);
        context.translate(-camera.east, -camera.north);
        if (s.fill) context.fill(set.path, "evenodd");
        if (s.stroke) context.stroke(set.path);
        context.restore();
        context.globalAlpha = 1;
      },
      image(canvas, x, y, width, height, alpha = 1) {
        context.globalAlpha = alpha;
        context.imageSmoothingEnabled = false;
        context.drawImage(canvas, x, y, width, height);
        context.globalAlpha = 1;
      },
      text(words, x, y, s) {
        context.font = `${s.weight ?? 500} ${s.size ?? 11}px system-ui, sans-serif`;
        context.textAlign = s.align ?? "left";
        context.textBaseline = "middle";
        context.setLineDash([]);
        if (s.halo) {
          context.lineJoin = "round";
          context.lineWidth = 3.5;
          context.strokeStyle = s.halo;
          context.strokeText(words, x, y);
        }
        context.fillStyle = s.fill;
        context.fillText(words, x, y);
      },
    };
  };

  MF.svgPen = (camera, view) => {
    const out = [];
    const f = (value) => (Math.round(value * 10) / 10).toString();
    // XML allows neither these signs raw nor control characters at all.
    const safe = (text) => String(text).replace(/[\u0000-\u0008\u000b\u000c\u000e-\u001f]/g, "")
      .replace(/[&<>"']/g, (c) => `&#${c.charCodeAt(0)};`);
    const looks = (s) => `fill="${safe(s.fill ?? "none")}"`
      + (s.stroke ? ` stroke="${safe(s.stroke)}" stroke-width="${f(s.width ?? 1)}" stroke-linejoin="round"` : "")
      + (s.stroke && !s.dash ? ' stroke-linecap="round"' : "")
      + (s.dash ? ` stroke-dasharray="${s.dash.join(" ")}"` : "")
      + ((s.alpha ?? 1) < 1 ? ` opacity="${s.alpha}"` : "");
    return {
      view, camera,
      rect: (x, y, width, height, s) => out.push(`<rect x="${f(x)}" y="${f(y)}" width="${f(width)}" height="${f(height)}" ${looks(s)}/>`),
      circle: (x, y, r, s) => out.push(`<circle cx="${f(x)}" cy="${f(y)}" r="${f(Math.max(r, 0))}" ${looks(s)}/>`),
      path(points, s, closed = false) {
        if (points.length < 2) return;
        out.push(`<path d="M${points.map(([x, y]) => `${f(x)} ${f(y)}`).join("L")}${closed ? "Z" : ""}" ${looks(s)}/>`);
      },
      lines(set, s, closed = false) {
        const parts = [];
        for (let l = 0; l + 1 < set.first.length; l += 1) {
          const points = [];
          let [x0, x1, y0, y1] = [Infinity, -Infinity, Infinity, -Infinity];
          for (let i = set.first[l]; i < set.first[l + 1]; i += 1) {
            const x = camera.x(set.east[i], view);
            const y = camera.y(set.north[i], view);
            [x0, x1, y0, y1] = [Math.min(x0, x), Math.max(x1, x), Math.min(y0, y), Math.max(y1, y)];
            points.push(`${f(x)} ${f(y)}`);
          }
          // Also a line that crosses the frame with all its corners outside.
          const seen = x1 > -50 && y1 > -50 && x0 < view.width + 50 && y0 < view.height + 50;
          if (seen && points.length > 1) parts.push(`M${points.join("L")}${closed ? "Z" : ""}`);
        }
        out.push(`<path fill-rule="evenodd" d="${parts.join("")}" ${looks(s)}/>`);
      },
      image: (canvas, x, y, width, height, alpha = 1) => out.push(`<image x="${f(x)}" y="${f(y)}" width="${f(width)}" height="${f(height)}" `
        + `opacity="${alpha}" preserveAspectRatio="none" style="image-rendering:pixelated" href="${canvas.toDataURL("image/png")}"/>`),
      text(words, x, y, s) {
        const anchor = { left: "start", center: "middle", right: "end" }[s.align ?? "left"];
        const halo = s.halo ? ` stroke="${safe(s.halo)}" stroke-width="3.5" stroke-linejoin="round" paint-order="stroke"` : "";
        out.push(`<text x="${f(x)}" y="${f(y)}" dy=".35em" font-family="system-ui, sans-serif" font-size="${s.size ?? 11}" `
          + `font-weight="${s.weight ?? 500}" text-anchor="${anchor}" fill="${safe(s.fill)}"${halo}>${safe(words)}</text>`);
      },
      document: (title) => `<svg xmlns="http://www.w3.org/2000/svg" width="${view.width}" height="${view.height}" `
        + `viewBox="0 0 ${view.width} ${view.height}"><title>${safe(title)}</title>${out.join("\n")}</svg>`,
    };
  };
})();
