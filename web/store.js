// The one place where the page's state lives: whoever changes it says what, whoever shows it hears of it
// at most once a frame.

/** Open a store; `on(keys, listen)` hears of every change of these keys, and of the language and unit. */
export function createStore(initial) {
  const state = {
    rig: null, connection: "connecting", kind: "north-seek", prediction: null, planError: null,
    run: null, visits: [], estimates: [], events: [], progress: null,
    runs: [], total: null, compare: [], units: "deg", lang: "en",
    ...initial,
  };
  const listeners = [];
  const changed = new Set();
  let asked = false;

  function tell() {
    asked = false;
    const keys = new Set(changed);
    changed.clear();
    for (const { wanted, listen } of listeners) {
      if (keys.has("lang") || wanted.some((key) => keys.has(key))) attempt(listen, state);
    }
  }

  function set(patch) {
    Object.assign(state, patch);
    Object.keys(patch).forEach((key) => changed.add(key));
    if (asked) return;
    asked = true;
    requestAnimationFrame(tell);
  }

  function on(keys, listen) {
    listeners.push({ wanted: Array.isArray(keys) ? keys : [keys], listen });
    attempt(listen, state);
  }

  return { state, set, on };
}

// One panel that cannot draw itself must not take STOP and the azimuth with it.
function attempt(listen, state) {
  try {
    listen(state);
  } catch (error) {
    reportError(error);
  }
}
