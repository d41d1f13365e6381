"use strict";
// Dark and light: the system's choice until a button says otherwise. Canvases read the same colors as the styles.
(() => {
  const NAMES = ["paper", "card", "ink", "soft", "line", "ground", "street", "building", "house", "halo", "here", "there",
    "alternative", "truth", "belief", "searching", "converged", "tracking", "uncertain", "lost", "outside", "accent"];
  const system = window.matchMedia("(prefers-color-scheme: dark)");
  const listeners = [];

  const read = () => {
    const style = getComputedStyle(document.documentElement);
    return Object.fromEntries(NAMES.map((name) => [name, style.getPropertyValue(`--${name}`).trim()]));
  };
  const apply = (theme) => {
    document.documentElement.dataset.theme = theme;
    MF.color = read();
    MF.themeName = theme;
    for (const listener of listeners) listener(theme);
  };
  let chosen = null;
  MF.toggleTheme = () => {
    chosen = MF.themeName === "dark" ? "light" : "dark";
    apply(chosen);
  };
  MF.onTheme = (listener) => listeners.push(listener);
  MF.startTheme = () => {
    apply(system.matches ? "dark" : "light");
    system.addEventListener("change", () => { if (!chosen) apply(system.matches ? "dark" : "light"); });
    let before = null;
    window.addEventListener("beforeprint", () => { before = MF.themeName; apply("light"); });
    window.addEventListener("afterprint", () => { if (before) apply(before); });
  };
  MF.rgb = (hex) => [1, 3, 5].map((i) => parseInt(hex.slice(i, i + 2), 16));
  MF.statusColor = (name) => MF.color[String(name).toLowerCase()] || MF.color.soft;
  // Cells: a color each by the golden angle, two lightnesses in turn, so that neighbours in the list differ.
  MF.cellRgb = (index) => {
    const hue = (index * 137.508 + 205) % 360;
    const light = (MF.themeName === "dark" ? [0.56, 0.4, 0.66] : [0.62, 0.75, 0.48])[index % 3];
    const chroma = 0.5 * Math.min(light, 1 - light) * 0.95;
    const part = (n) => {
      const k = (n + hue / 30) % 12;
      return Math.round(255 * (light - chroma * Math.max(-1, Math.min(k - 3, 9 - k, 1))));
    };
    return [part(0), part(8), part(4)];
  };
  MF.css = ([r, g, b], alpha = 1) => `rgba(${r},${g},${b},${alpha})`;
})();
