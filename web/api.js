// Talks to the service: requests that throw a Problem, and the two streams that keep the page live.

import { ENDED } from "./run.js";

const ROOT = "/api/v1";
const DEADLINE_MS = 10000;
const START_DEADLINE_MS = 20000; // longer than the service tries: a start that is given up here must not happen later
const SILENCE_MS = 4000; // the rig reports twice a second at least
const RETRY_MS = 1000;
const KINDS = ["state", "progress", "visit", "estimate", "warning", "error", "result"];

/** What the service refused, in its own words (RFC 9457); status 0 where it could not be reached. */
export class Problem extends Error {
  constructor(status, body) {
    super(body.detail ?? body.title ?? `HTTP ${status}`);
    Object.assign(this, body, { status });
  }
}

let admit = null; // asks for the token
let admitting = null;

/** Let `ask` get the reader a session whenever one is missing; it resolves when there is one. */
export const onUnauthorized = (ask) => { admit = ask; };

const unanswered = (cause) => { throw new Problem(0, { detail: "The service did not answer.", cause }); };

async function request(method, path, body, headers = {}, deadline_ms = DEADLINE_MS) {
  const json = body && { "Content-Type": "application/json" };
  const answer = await fetch(ROOT + path, {
    method, headers: { ...json, ...headers }, body: body && JSON.stringify(body), signal: AbortSignal.timeout(deadline_ms),
  }).catch(unanswered);
  if (answer.status === 401 && path !== "/session") {
    admitting ??= admit().finally(() => { admitting = null; });
    await admitting;
    return request(method, path, body, headers, deadline_ms);
  }
  const said = answer.headers.get("content-type")?.includes("json") ? await answer.json().catch(unanswered) : {};
  if (!answer.ok) throw new Problem(answer.status, said);
  return said;
}

export const get = (path, deadline_ms) => request("GET", path, undefined, {}, deadline_ms);
export const post = (path, body, headers, deadline_ms) => request("POST", path, body, headers, deadline_ms);
export const patch = (path, body) => request("PATCH", path, body);
export const del = (path) => request("DELETE", path);

/** Do what the page cannot do without, again until it is done; what hinders it is said across the page meanwhile. */
export async function insist(act, store) {
  for (let hindered = false; ; hindered = true) {
    try {
      const done = await act();
      if (hindered) store.set({ trouble: null });
      return done;
    } catch (problem) {
      store.set({ trouble: problem.message });
      await new Promise((resolve) => setTimeout(resolve, RETRY_MS));
    }
  }
}

/** Start a run and show it. */
export async function startRun(plan, store) {
  const key = crypto.getRandomValues(new Uint32Array(4)).join("-");
  const { run_id } = await post("/runs", plan, { "Idempotency-Key": key }, START_DEADLINE_MS);
  await openRun(run_id, store);
}

/** Load the newest runs into the store. */
export async function loadRuns(store) {
  const { runs, total = null } = await get("/runs?limit=50");
  store.set({ runs, total });
}

// A hidden tab gives its connection back: a browser opens only six to one host.
function whileVisible(open, close) {
  const turn = () => (document.hidden ? close() : open());
  document.addEventListener("visibilitychange", turn);
  turn();
  return () => document.removeEventListener("visibilitychange", turn);
}

/** Keep `rig` and `connection` live in the store; a stream that falls silent is opened again. */
export function openRig(store) {
  let source = null;
  let heard_ms = 0;
  const open = () => {
    source?.close();
    heard_ms = performance.now();
    source = new EventSource(`${ROOT}/rig/events`);
    source.addEventListener("rig", ({ data }) => {
      heard_ms = performance.now();
      store.set({ rig: JSON.parse(data), connection: "live" });
    });
    source.onerror = () => store.set({ connection: "lost" });
  };
  whileVisible(open, () => source?.close());
  setInterval(async () => {
    if (document.hidden || performance.now() - heard_ms < SILENCE_MS) return;
    heard_ms = performance.now();
    store.set({ connection: "lost" });
    if (await get("/rig").catch(() => null)) open(); // asking also brings the token's form where the session expired
  }, RETRY_MS);
}

let shown = null; // the run shown

/** Show a run and follow it while it lives: every event once and in order, over reconnects and sleep. */
export async function openRun(id, store) {
  shown?.close();
  shown = new Following(id, store);
  await shown.load();
}

class Following {
  constructor(id, store) {
    Object.assign(this, { id, store, seen: 0, last: 0, lists: { visits: [], estimates: [], events: [] } });
  }

  /** Take the run as the service knows it; open its stream where there is more to hear, close it where it has ended. */
  async load() {
    if (shown !== this) return;
    const run = await get(`/runs/${this.id}`);
    if (shown !== this || run.last_seq < this.last) return;
    this.last = run.last_seq;
    this.store.set(this.seen ? { run } : { run, ...this.lists, progress: null });
    if (!ENDED.includes(run.state) || this.seen < this.last) this.unwatch ??= whileVisible(() => this.listen(), () => this.source?.close());
    else this.close();
    await loadRuns(this.store);
  }

  listen() {
    this.source?.close();
    const source = (this.source = new EventSource(`${ROOT}/runs/${this.id}/events`));
    for (const kind of KINDS) source.addEventListener(kind, ({ data }) => data && this.take(kind, JSON.parse(data)));
    source.onerror = () => source.readyState === EventSource.CLOSED && setTimeout(() => this.unwatch && this.listen(), RETRY_MS);
  }

  take(kind, data) {
    if (shown !== this || data.seq <= this.seen) return;
    this.seen = data.seq;
    if (kind === "progress") {
      this.store.state.run.progress = data.progress;
      this.store.set({ progress: { ...data, heard_ms: performance.now() } });
    } else if (kind === "estimate") this.grow("estimates", data);
    else this.grow("events", { ...data, kind });
    if (kind === "visit") this.grow("visits", data);
    if (data.seq >= this.last && ["state", "error", "result"].includes(kind)) insist(() => this.load(), this.store);
  }

  grow(list, data) {
    this.lists[list].push(data); // in place: a hold of a day has 86 400 estimates
    this.store.set({ [list]: this.lists[list] });
  }

  close() {
    this.unwatch?.();
    this.unwatch = null;
    this.source?.close();
  }
}
