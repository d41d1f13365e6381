"use strict";
// A document that only remembers what is put into it, for the page's scripts in node.
class Node {
  constructor(tag) { Object.assign(this, { tag, children: [], attributes: {}, listeners: {}, dataset: {}, value: "", width: 0,
    height: 0, clientWidth: 100, clientHeight: 100, offsetWidth: 0, offsetHeight: 0, hidden: false });
    this.style = { setProperty() {} }; }
  append(...more) { this.children.push(...more); }
  replaceChildren(...more) { this.children = more; }
  setAttribute(name, value) { this.attributes[name] = String(value); }
  addEventListener(name, listener) { this.listeners[name] = listener; }
  getBoundingClientRect() { return { left: 0, top: 0 }; }
  closest() { return null; }
  remove() {}
  getContext() { return new Proxy({}, { get: (_, name) => (name === "createImageData"
    ? (width, height) => ({ data: new Uint8Array(4 * width * height) })
    : name === "putImageData" ? (image) => { this.pixels = new Uint32Array(image.data.buffer); } : () => {}), set: () => true }); }
  get textContent() { return this.children.map((one) => (one instanceof Node ? one.textContent : String(one))).join(""); }
  set textContent(words) { this.children = [words]; }
  get options() { return this.all("option"); }
  get length() { return this.options.length; }
  all(tag) { return this.children.flatMap((one) => (one instanceof Node ? [...(one.tag === tag ? [one] : []), ...one.all(tag)] : [])); }
}
const ids = {};
const keys = [];
globalThis.Node = Node;
globalThis.document = { createElement: (tag) => new Node(tag), createElementNS: (_, tag) => new Node(tag), body: new Node("body"),
  createTextNode: (words) => words, getElementById: (id) => (ids[id] ??= new Node(id)), querySelector: () => new Node("div"),
  documentElement: new Node("html"), addEventListener: (_, listener) => keys.push(listener) };
globalThis.window = { matchMedia: () => ({ addEventListener() {} }), addEventListener() {}, location: { hash: "", search: "", href: "" },
  history: { replaceState(_, __, hash) { window.location.hash = hash; } }, innerWidth: 800 };
globalThis.getComputedStyle = () => ({ getPropertyValue: () => "#123456" });
globalThis.requestAnimationFrame = (task) => { globalThis.frame = task; };
globalThis.Path2D = class { moveTo() {} lineTo() {} closePath() {} };
globalThis.uPlot = class {
  constructor() { Object.assign(this, { over: new Node("div"), root: new Node("div"), scales: { x: { min: 0, max: 1 } } }); }
  valToPos() { return 0; } destroy() {} setData() {} redraw() {}
};
let now_ms = 0;
// Draws what has changed, a second later.
const draw = () => { now_ms += 1000; globalThis.frame(now_ms); };
const press = (key, target = new Node("body")) => {
  const event = { key, target, prevented: false, preventDefault() { this.prevented = true; } };
  for (const one of keys) one(event);
  return event.prevented;
};
