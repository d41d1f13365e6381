"use strict";
// Numbers as a person reads them, with units.
(() => {
  const dash = "–";
  const minus = (text) => text.replace("-", "−");

  MF.number = (value, digits = 0, unit = "") => {
    if (value === Infinity) return "∞";
    if (!Number.isFinite(value)) return dash;
    const text = minus(value.toFixed(digits)).replace(/^−(0(\.0+)?)$/, "$1");
    return unit ? `${text}\u202f${unit}` : text;
  };
  MF.metres = (value) => {
    if (value === Infinity) return "unavailable";
    if (Number.isFinite(value) && Math.abs(value) >= 10000) return MF.number(value / 1000, 1, "km");
    return MF.number(value, Math.abs(value) < 10 ? 1 : 0, "m");
  };
  MF.dbm = (value) => MF.number(value, 1, "dBm");
  MF.nats = (value, digits = 2) => (Number.isFinite(value) && value > 0 ? "+" : "") + MF.number(value, digits);
  MF.share = (value) => {
    if (!Number.isFinite(value)) return dash;
    if (value > 0.999) return "> 99.9\u202f%";
    if (value > 0 && value < 0.001) return "< 0.1\u202f%";
    return MF.number(100 * value, value < 0.1 || value > 0.99 ? 1 : 0, "%");
  };
  // Seconds since the start as h:mm:ss or m:ss.
  MF.clock = (seconds, digits = 0) => {
    if (!Number.isFinite(seconds)) return dash;
    const sign = seconds < 0 ? "−" : "";
    // Differences of times fall short of whole seconds by rounding.
    const most = 10 ** (digits || 3);
    const all = Math.round(Math.abs(seconds) * most) / most;
    const h = Math.floor(all / 3600);
    const m = Math.floor((all % 3600) / 60);
    const s = (digits ? (all % 60).toFixed(digits) : String(Math.floor(all % 60))).padStart(digits ? 3 + digits : 2, "0");
    return sign + (h ? `${h}:${String(m).padStart(2, "0")}:${s}` : `${m}:${s}`);
  };
  // Times of a device, which may count from any start: those of 1973 to 2099 are dates.
  MF.isDate = (seconds) => seconds >= 1e8 && seconds < 4.1e9;
  MF.moment = (seconds) => (MF.isDate(seconds) ? `${new Date(1000 * seconds).toISOString().slice(0, 19).replace("T", " ")} UTC`
    : MF.number(seconds ?? NaN, 0, "s"));
  // A ratio of likelihoods in words; nats are its logarithm.
  MF.times = (nats) => {
    const ratio = Math.exp(Math.abs(nats));
    if (ratio < 1.05) return "about as likely as";
    const text = ratio > 9999 ? "more than 10\u202f000" : ratio.toFixed(ratio < 10 ? 1 : 0);
    return `${text} times ${nats > 0 ? "more" : "less"} likely than`;
  };
  // What tells names apart: without the parts, divided by commas, that all of them begin or end with.
  MF.apart = (names) => {
    const parts = names.map((one) => one.split(", "));
    const most = Math.min(...parts.map((one) => one.length)) - 1;
    const shared = (at) => {
      let count = 0;
      while (count < most && parts.every((one) => at(one, count) === at(parts[0], count))) count += 1;
      return count;
    };
    const first = shared((one, k) => one[k]);
    const last = Math.min(shared((one, k) => one[one.length - 1 - k]), most - first);
    return parts.map((one) => one.slice(first, one.length - last).join(", "));
  };
  MF.degrees = (lat, lon) => `${Math.abs(lat).toFixed(5)}° ${lat < 0 ? "S" : "N"}, ${Math.abs(lon).toFixed(5)}° ${lon < 0 ? "W" : "E"}`;
})();
