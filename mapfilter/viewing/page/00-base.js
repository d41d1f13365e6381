"use strict";
// One name for all parts of the page; each file adds its own duty to it.
const MF = {};

(() => {
  // Elements are made with textContent only: every string of a bundle is somebody else's.
  MF.h = (tag, attributes = {}, ...children) => {
    const element = document.createElement(tag);
    for (const [name, value] of Object.entries(attributes)) {
      if (value === null || value === undefined || value === false) continue;
      if (name.startsWith("on")) element.addEventListener(name.slice(2), value);
      else if (name === "style") for (const [key, one] of Object.entries(value)) element.style.setProperty(key, one);
      else element.setAttribute(name, value === true ? "" : value);
    }
    for (const child of children.flat(3)) {
      if (child === null || child === undefined || child === false) continue;
      element.append(child instanceof Node ? child : document.createTextNode(String(child)));
    }
    return element;
  };

  MF.byId = (id) => document.getElementById(id);

  MF.clamp = (value, low, high) => Math.min(Math.max(value, low), high);

  // Index of the last entry at or before a value in an ascending array; 0 where all are after it.
  MF.lastAt = (array, value, count = array.length) => {
    let low = 0;
    let high = count;
    while (low < high) {
      const middle = (low + high) >> 1;
      if (array[middle] <= value) low = middle + 1;
      else high = middle;
    }
    return Math.max(low - 1, 0);
  };

  // State with listeners: set() tells each listener which keys changed.
  MF.store = (state) => {
    const listeners = [];
    return {
      state,
      listen: (listener) => listeners.push(listener),
      set(change) {
        const changed = new Set(Object.keys(change).filter((key) => !Object.is(state[key], change[key])));
        if (!changed.size) return;
        Object.assign(state, change);
        for (const listener of listeners) listener(changed, state);
      },
    };
  };
})();
