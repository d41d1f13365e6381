"use strict";
(async () => {
  const text = document.getElementById("mapfilter-bundle").textContent.trim();
  const bytes = Uint8Array.from(atob(text), (one) => one.charCodeAt(0));
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip"));
  const bundle = await new Response(stream).json();
  document.getElementById("facts").textContent = `${bundle.title}: ${bundle.runs.length} runs`;
})();
