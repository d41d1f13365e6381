"use strict";
// A radio report by itself at any place: the filter's equations for one report, nothing known of the cells' errors.
// The same as report_terms of tests/report_terms.py; a test compares both.
(() => {
  const ROOT_PI = Math.sqrt(Math.PI);

  // ln erfc(z) for z ≥ 2 by its continued fraction (Lentz), which does not underflow.
  const logErfcTail = (z) => {
    let f = z;
    let c = z;
    let d = 0;
    for (let k = 1; k < 200; k += 1) {
      d = 1 / (z + (k / 2) * d);
      c = z + k / 2 / c;
      f *= c * d;
      if (Math.abs(c * d - 1) < 1e-15) break;
    }
    return -z * z - Math.log(f * ROOT_PI);
  };
  const erfSmall = (z) => {
    let term = z;
    let sum = z;
    for (let n = 1; n < 200 && Math.abs(term) > 1e-17 * Math.abs(sum); n += 1) {
      term *= (2 * z * z) / (2 * n + 1);
      sum += term;
    }
    return (2 / ROOT_PI) * Math.exp(-z * z) * sum;
  };
  // ln Φ(x), the logarithm of the normal distribution function.
  MF.logNormal = (x) => {
    const z = -x / Math.SQRT2;
    if (z > 2) return logErfcTail(z) - Math.LN2;
    if (z < -2) return Math.log1p(-0.5 * Math.exp(logErfcTail(-z)));
    return Math.log(0.5 * (1 - erfSmall(z)));
  };

  const logAdd = (a, b) => {
    const top = Math.max(a, b);
    return top + Math.log1p(Math.exp(Math.min(a, b) - top));
  };
  // Log-likelihood of a reading whose prediction may be wrong with log odds `odds`.
  const mixed = (odds, other, right) => logAdd(right, odds + other) - logAdd(0, odds);

  const streets = (distance, why) => {
    const near = 0.97 * Math.exp(-0.5 * (distance / why.map_sd_m) ** 2) + 0.03 * Math.exp(-distance / 30);
    return Math.max(why.map_weight_per_m * why.map_m * Math.log(near), -why.off_cost_per_m * why.map_m);
  };

  // What the map has at a place: of each band level, roughness, and the two strongest levels of its layer; null outside the map.
  MF.mapAt = (levels, east, north) => {
    const { grid } = levels;
    const col = Math.floor((east - grid.west) / grid.step);
    const row = Math.floor((grid.north - north) / grid.step);
    if (!(col >= 0 && row >= 0 && col < grid.cols && row < grid.rows)) return null;
    const at = row * grid.cols + col;
    const quiet = (value) => (Number.isFinite(value) ? value : levels.quiet_dbm);
    // Pages of earlier versions have one layer.
    const ofLayer = (values, band) => quiet(values.at((levels.layer?.[band] ?? 0) * levels.size + at));
    return {
      level: (band) => quiet(levels.level.at(band * levels.size + at)),
      rough: (band) => levels.rough.at(band * levels.size + at) || 0,
      best: (band) => ofLayer(levels.best, band),
      second: (band) => ofLayer(levels.second, band),
      distance: levels.distance.raw[at] === levels.distance.none ? 255 : levels.distance.at(at),
    };
  };

  // Rows {term, band, nats} of a report {serving: band or -1, bands: […], levels: […]} at a place, streets first.
  MF.reportTerms = (report, place, why) => {
    const rows = [{ term: "streets", band: -1, nats: streets(place.distance, why) }];
    const odds = new Map();
    const oddsOf = (band) => odds.get(band) ?? why.fault_log_odds;
    if (report.serving >= 0) {
      const own = place.level(report.serving);
      const best = place.best(report.serving);
      const margin = own - (own >= best ? place.second(report.serving) : best);
      const weight = why.serving_weight * (report.bands.length ? why.serving_with_levels : 1);
      const right = weight * MF.logNormal((margin + why.hysteresis_db) / why.sd_db);
      const other = -weight * why.fault_nats;
      const before = oddsOf(report.serving);
      rows.push({ term: "serving", band: report.serving, nats: mixed(before, other, right) });
      odds.set(report.serving, MF.clamp(before + other - right, -8, 8));
    }
    const count = report.bands.length;
    const alike = (j, k) => why.common_share + (why.site[report.bands[j]] === why.site[report.bands[k]] ? why.site_share : 0)
      + (j === k ? 1 - why.site_share - why.common_share : 0);
    let covariance = Array.from({ length: count }, (_, j) => Array.from({ length: count }, (__, k) =>
      (why.slow_db ** 2 + why.fast_db ** 2) * alike(j, k) + why.device_db ** 2));
    const white = why.white_db ** 2 + why.offset_db ** 2;
    const bias = new Float64Array(count);
    for (let k = 0; k < count; k += 1) {
      const band = report.bands[k];
      const variance = covariance[k][k] + white;
      const gain = covariance.map((row) => row[k] / variance);
      const innovation = report.levels[k] - place.level(band) - bias[k];
      const wide = variance + why.roughness * place.rough(band) ** 2;
      const right = -0.5 * (innovation ** 2 / wide + Math.log(wide));
      const spread = why.other_db2 + white + 0.5 * why.fast_db ** 2 + why.other_rough_db2;
      const other = -0.5 * ((report.levels[k] - why.other_dbm) ** 2 / spread + Math.log(spread));
      const before = oddsOf(band);
      rows.push({ term: "level", band, nats: why.weight * mixed(before, other, right) });
      const fine = 1 / (1 + Math.exp(Math.min(before + other - right, 700)));
      const row = [...covariance[k]];
      for (let j = 0; j < count; j += 1) bias[j] += (gain[j] * fine * innovation * variance) / wide;
      covariance = covariance.map((own, j) => own.map((one, l) => one - gain[j] * row[l]));
    }
    return rows;
  };
})();
