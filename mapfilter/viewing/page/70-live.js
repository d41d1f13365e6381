"use strict";
// A session of a service: its map, its events, and what to do when the connection is lost.
(() => {
  const [AGAIN_MS, REFUSED_MS, SETTLE_MS, LIST_MS] = [5000, 10000, 500, 5000];
  const key = new URLSearchParams(window.location.search).get("key");

  const ask = async (path, signal) => {
    const answer = await fetch(path, { cache: "no-store", signal, headers: key ? { authorization: `Bearer ${key}` } : {} });
    if (answer.ok) return answer;
    const told = await answer.json().catch(() => null);
    throw Object.assign(new Error(told?.error?.message ?? `The service answered ${answer.status}.`), { code: answer.status });
  };

  const follow = (id, run) => {
    const live = { run, state: "connecting", listeners: [] };
    const tell = (state = live.state) => {
      live.state = state;
      for (const listener of live.listeners) listener(state);
    };
    const address = (more = {}) => `../sessions/${id}/events?${new URLSearchParams({ detail: "1", after: run.last, ...more })}`;
    const connect = () => {
      // An event source has no headers for a token.
      const events = new EventSource(address(key ? { key } : {}));
      events.addEventListener("open", () => tell("live"));
      events.addEventListener("fix", (event) => { run.push(JSON.parse(event.data)); tell(); });
      events.addEventListener("belief", (event) => { run.pushBelief(JSON.parse(event.data)); tell(); });
      events.addEventListener("end", (event) => {
        events.close();
        const { reason } = JSON.parse(event.data);
        if (reason !== "stopped") tell(`ended: ${reason}`);
        else again();
      });
      // The browser comes back by itself after a cut, with the number of its last event; not after a refusal.
      events.addEventListener("error", () => {
        if (events.readyState !== EventSource.CLOSED) tell("reconnecting");
        else again("reconnecting", SETTLE_MS);
      });
    };
    // An event source does not say why it was refused; a request for the same stream does.
    const again = (state = "reconnecting", wait = AGAIN_MS) => {
      tell(state);
      setTimeout(async () => {
        const tried = new AbortController();
        try {
          await ask(address(), tried.signal);
          tried.abort();
          setTimeout(connect, SETTLE_MS);
        } catch (error) {
          if (error.code === 404 || error.code === 401) tell(`ended: ${error.message}`);
          else if (error.code === 429) again(`refused: ${error.message}`, REFUSED_MS);
          else again();
        }
      }, wait);
    };
    connect();
    return live;
  };

  const sessionRow = (one) => MF.h("tr", {}, MF.h("td", {}, MF.h("a", { href: `${encodeURIComponent(one.id)}${window.location.search}` }, one.name || one.id)),
    MF.h("td", {}, one.epochs), MF.h("td", {}, MF.moment(one.time_s)), MF.h("td", {}, new Date(1000 * one.began_utc_s).toISOString().slice(0, 19).replace("T", " ")));
  const showSessions = async () => {
    const body = MF.h("div", {});
    MF.byId("title").textContent = document.title = "Sessions";
    document.body.dataset.kind = "sessions";
    for (const id of ["stage", "side", "charts"]) MF.byId(id).hidden = true;
    MF.byId("facts").replaceChildren(MF.h("section", { class: "card" }, body));
    const refresh = async () => {
      const { sessions } = await (await ask("../sessions")).json();
      const head = ["Session", "epochs", "time", "began (UTC)"].map((words) => MF.h("th", { scope: "col" }, words));
      body.replaceChildren(sessions.length ? MF.h("table", {}, MF.h("thead", {}, MF.h("tr", {}, head)), MF.h("tbody", {}, sessions.map(sessionRow)))
        : MF.h("p", { class: "empty" }, "No session is open. A device begins one with POST /sessions."));
    };
    await refresh();
    document.documentElement.dataset.ready = "true";
    setInterval(() => refresh().catch((error) => body.replaceChildren(MF.h("p", { class: "failure", role: "alert" }, error.message))), LIST_MS);
  };

  // Opens what the address names: all sessions, or one, which `start` shows.
  MF.openLive = async (start) => {
    const id = decodeURIComponent(window.location.pathname.split("/").pop());
    if (!id) { await showSessions(); return; }
    const session = await (await ask(`../sessions/${encodeURIComponent(id)}`)).json();
    const bundle = await MF.unzipped(await (await ask("map")).blob());
    const name = session.name || `Session ${id.slice(0, 6)}`;
    const run = MF.makeLiveRun(bundle, name);
    start({ ...bundle, title: name, place: bundle.title }, follow(encodeURIComponent(id), run));
  };
})();
