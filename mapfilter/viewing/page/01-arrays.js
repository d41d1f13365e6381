"use strict";
// Arrays of the bundle: little-endian numbers as base64, with scale, offset and a code for "unknown".
(() => {
  const TYPES = { u1: Uint8Array, i1: Int8Array, u2: Uint16Array, i2: Int16Array, u4: Uint32Array,
    i4: Int32Array, f4: Float32Array, f8: Float64Array };

  const bytesOf = (text) => {
    if (Uint8Array.fromBase64) return Uint8Array.fromBase64(text);
    const raw = atob(text);
    const bytes = new Uint8Array(raw.length);
    for (let i = 0; i < raw.length; i += 1) bytes[i] = raw.charCodeAt(i);
    return bytes;
  };
  MF.bytesOf = bytesOf;

  // Raw numbers with their reading: at(i) is a value, NaN where unknown.
  MF.array = (one) => {
    const bytes = bytesOf(one.b);
    const raw = new TYPES[one.t](bytes.buffer, bytes.byteOffset, bytes.byteLength / TYPES[one.t].BYTES_PER_ELEMENT);
    const k = one.k ?? 1;
    const o = one.o ?? 0;
    const none = one.n ?? null;
    const at = (i) => (i < 0 || i >= raw.length || raw[i] === none ? NaN : raw[i] * k + o);
    return { raw, k, o, none, shape: one.s, length: raw.length, at };
  };

  // All values at once.
  MF.numbers = (one) => {
    const array = MF.array(one);
    return Float64Array.from(array.raw, (_, i) => array.at(i));
  };

  MF.isArray = (one) => one !== null && typeof one === "object" && typeof one.b === "string" && one.t in TYPES;

  // JSON of gzip, from a tag of the page or from a service.
  MF.unzipped = async (blob) => {
    if (typeof DecompressionStream === "undefined") {
      throw new Error("This browser is too old to unpack the data (DecompressionStream, 2023 or later).");
    }
    const bundle = await new Response(blob.stream().pipeThrough(new DecompressionStream("gzip"))).json();
    if (bundle.format !== "mapfilter-view" || bundle.version !== 1) {
      throw new Error(`Expected format mapfilter-view 1, found ${bundle.format} ${bundle.version}.`);
    }
    return bundle;
  };

  // The bundle in the page, gzip as base64 in a tag.
  MF.readBundle = async () => {
    const text = MF.byId("mapfilter-bundle").textContent.trim();
    if (!text) throw new Error("This page has no data in it. Make it again with 'mapfilter view'.");
    return MF.unzipped(new Blob([bytesOf(text)]));
  };
})();
