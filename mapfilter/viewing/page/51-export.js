"use strict";
// The frame as a file: PNG by the canvas pen, SVG by the other, with a line that says what it shows.
(() => {
  const save = (blob, name) => {
    const address = URL.createObjectURL(blob);
    const link = MF.h("a", { href: address, download: name });
    document.body.append(link);
    link.click();
    link.remove();
    setTimeout(() => URL.revokeObjectURL(address), 10000);
  };
  const nameOf = (page, ending) => {
    const { state } = page.store;
    const run = page.runs[state.run];
    const words = `${run ? `${run.name}-${Math.round(state.time)}s` : page.bundle.title}`;
    return `${words.replace(/[^\p{L}\p{N}._-]+/gu, "-").slice(0, 80)}.${ending}`;
  };
  const caption = (page, pen, map) => {
    const { state } = page.store;
    const run = map.run;
    const words = run ? `${run.name} · ${MF.clock(state.time - page.start)} · ${run.statusAt(state.time).toLowerCase()}` : page.bundle.title;
    pen.text(words, 12, 18, { fill: MF.color.ink, halo: MF.color.halo, size: 14, weight: 650 });
    pen.text(page.bundle.attribution ?? "", 12, map.view.height - 12, { fill: MF.color.soft, halo: MF.color.halo, size: 10 });
  };
  const mapOf = (page) => page.maps.find((map) => !map.run || map.run.index === page.store.state.run) ?? page.maps[0];

  MF.frameSvg = (page) => {
    const map = mapOf(page);
    const pen = MF.svgPen(page.camera, map.view);
    map.paintAll(pen);
    caption(page, pen, map);
    return pen.document(page.bundle.title);
  };
  MF.exportSvg = (page) => save(new Blob([MF.frameSvg(page)], { type: "image/svg+xml" }), nameOf(page, "svg"));

  MF.exportPng = (page) => {
    const map = mapOf(page);
    const canvas = MF.h("canvas", { width: 2 * map.view.width, height: 2 * map.view.height });
    const context = canvas.getContext("2d");
    context.scale(2, 2);
    const pen = MF.canvasPen(context, page.camera, map.view);
    map.paintAll(pen);
    caption(page, pen, map);
    canvas.toBlob((blob) => save(blob, nameOf(page, "png")), "image/png");
  };
})();
