"use strict";
// The bar of tools: layer under the tracks, what the maps show, second map, exports, theme, help.
(() => {
  const layersOf = (page) => {
    const { ground } = page;
    const list = [["none", ground.streets ? "Streets only" : "None"]];
    if (ground.best) list.push(["best", "Best server"], ["strength", "Level of the best server"], ["margin", "Margin"]);
    if (ground.points) list.push(["points", "Points"]);
    ground.bounds.forEach((one, number) => list.push([`bound ${number}`, one.name]));
    for (const cell of ground.levels?.cells ?? []) list.push([`level ${cell}`, `Level of ${ground.cellName(cell)}`]);
    return list;
  };

  const layerField = (page) => {
    const select = MF.h("select", { id: "layer" }, layersOf(page).map(([value, words]) => MF.h("option", { value }, words)));
    select.addEventListener("change", () => {
      const [layer, cell] = select.value.split(" ");
      page.store.set({ layer, layerCell: cell === undefined ? -1 : Number(cell) });
    });
    page.store.listen((changed, { layer, layerCell }) => {
      if (changed.has("layer") || changed.has("layerCell")) select.value = layer === "level" || layer === "bound" ? `${layer} ${layerCell}` : layer;
    });
    select.value = page.store.state.layer;
    return MF.h("label", { class: "field", hidden: select.length < 2 }, "Layer", select);
  };

  const runField = (page) => {
    const words = MF.apart(page.runs.map((run) => run.name));
    const options = () => page.runs.map((run, k) => MF.h("option", { value: run.index, title: run.name }, words[k]));
    const select = MF.h("select", { id: "second" }, MF.h("option", { value: -1 }, "one map"), options());
    select.value = page.store.state.second;
    select.addEventListener("change", () => page.store.set({ second: Number(select.value) }));
    const first = MF.h("select", { id: "run", "aria-label": "Run" }, options());
    first.value = page.store.state.run;
    first.addEventListener("change", () => page.store.set({ run: Number(first.value) }));
    page.store.listen((changed, state) => {
      if (changed.has("run")) first.value = state.run;
      if (changed.has("second")) select.value = state.second;
    });
    return [MF.h("label", { class: "field" }, "Run", first), MF.h("label", { class: "field" }, "beside", select)];
  };

  const helpDialog = () => {
    const dialog = MF.h("dialog", { "aria-labelledby": "keys-title" }, MF.h("h2", { id: "keys-title" }, "Keys"),
      MF.h("dl", {}, MF.KEYS.flatMap(([key, words]) => [MF.h("dt", {}, MF.h("kbd", {}, key)), MF.h("dd", {}, words)])),
      MF.h("button", { type: "button", onclick: () => dialog.close() }, "Close"));
    document.body.append(dialog);
    return dialog;
  };

  const LINK = "Link";
  const copyLink = async (page, button) => {
    MF.writeAddress(page);
    const address = window.location.href.split("#")[0] + MF.addressOf(page);
    let words = "Copied";
    try {
      await navigator.clipboard.writeText(address);
    } catch {
      words = window.top === window ? "In the address bar" : "Not in a frame";
    }
    button.textContent = words;
    MF.say(`Link to this moment: ${words.toLowerCase()}`);
    setTimeout(() => { button.textContent = LINK; }, 1600);
  };

  MF.makeTools = (page, host) => {
    const dialog = helpDialog();
    page.help = () => dialog.showModal();
    const button = (words, label, onclick) => MF.h("button", { type: "button", "aria-label": label, title: label, onclick: (event) => onclick(event.currentTarget) }, words);
    const theme = button("◐", "Dark or light (D)", () => MF.toggleTheme());
    theme.id = "theme";
    host.replaceChildren(...[layerField(page), ...(page.runs.length > 1 ? runField(page) : []),
      page.live ? null : button(LINK, "Copy a link to this moment", (one) => copyLink(page, one)), button("PNG", "Save the frame as PNG", () => MF.exportPng(page)),
      button("SVG", "Save the frame as SVG", () => MF.exportSvg(page)), button("Print", "Print this moment", () => window.print()),
      theme, button("?", "Keys (?)", page.help)].filter(Boolean));
  };

  // The live region: one sentence at a time for screen readers.
  MF.say = (words) => { MF.byId("live").textContent = words; };
})();
