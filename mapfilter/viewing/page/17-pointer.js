"use strict";
// Pointers and keys on a map: drag to move, wheel or pinch to zoom, click to ask about a place.
(() => {
  MF.listenToPointer = (page, map, hover) => {
    const { camera, store } = page;
    const { sheet } = map;
    const down = new Map();
    let moved = 0;
    let pinch = 0;

    const spot = (event) => {
      const box = sheet.getBoundingClientRect();
      return { x: event.clientX - box.left, y: event.clientY - box.top };
    };
    const ask = (x, y) => store.set({ place: { east: camera.eastOf(x, map.view), north: camera.northOf(y, map.view) },
      run: map.run ? map.run.index : store.state.run, against: "place" });
    const onSheet = (event) => !event.target.closest(".zoom, .legend");

    sheet.addEventListener("pointerdown", (event) => {
      if (!onSheet(event) || event.button > 0) return;
      sheet.setPointerCapture(event.pointerId);
      down.set(event.pointerId, spot(event));
      moved = 0;
      hover(null);
    });
    sheet.addEventListener("pointermove", (event) => {
      const now = spot(event);
      if (!down.has(event.pointerId)) {
        if (event.pointerType === "mouse" && onSheet(event)) hover({ ...now, east: camera.eastOf(now.x, map.view), north: camera.northOf(now.y, map.view) });
        else hover(null);
        return;
      }
      const before = down.get(event.pointerId);
      down.set(event.pointerId, now);
      moved += Math.abs(now.x - before.x) + Math.abs(now.y - before.y);
      if (down.size === 1) {
        if (moved > 4) camera.pan(now.x - before.x, now.y - before.y);
        return;
      }
      const [a, b] = [...down.values()];
      const apart = Math.hypot(a.x - b.x, a.y - b.y);
      if (pinch > 0) camera.zoom(apart / pinch, (a.x + b.x) / 2, (a.y + b.y) / 2, map.view);
      pinch = apart;
    });
    const up = (event) => {
      if (!down.delete(event.pointerId)) return;
      pinch = 0;
      if (event.type === "pointerup" && moved <= 4 && !down.size) ask(spot(event).x, spot(event).y);
    };
    sheet.addEventListener("pointerup", up);
    sheet.addEventListener("pointercancel", up);
    sheet.addEventListener("pointerleave", () => hover(null));
    sheet.addEventListener("wheel", (event) => {
      if (!onSheet(event)) return;
      event.preventDefault();
      camera.zoom(Math.exp(-event.deltaY * (event.deltaMode ? 0.05 : 0.0016)), spot(event).x, spot(event).y, map.view);
    }, { passive: false });
    sheet.addEventListener("keydown", (event) => {
      // Those with other modifiers are the browser's, as its own zoom.
      if (event.ctrlKey || event.metaKey || event.altKey) return;
      const { width, height } = map.view;
      const pans = { ArrowLeft: [60, 0], ArrowRight: [-60, 0], ArrowUp: [0, 60], ArrowDown: [0, -60] };
      if (pans[event.key] && (event.shiftKey || !map.run)) camera.pan(...pans[event.key]);
      else if (event.key === "+" || event.key === "=") camera.zoom(1.3, width / 2, height / 2, map.view);
      else if (event.key === "-") camera.zoom(1 / 1.3, width / 2, height / 2, map.view);
      else if (event.key === "Enter" && event.target === sheet) ask(width / 2, height / 2);
      else return;
      event.preventDefault();
      event.stopPropagation();
    });
  };
})();
