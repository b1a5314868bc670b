// SPDX-License-Identifier: LGPL-2.1-or-later
// Listening to the server. A hidden tab gives its connection back: a browser opens only six to one server.

const FIRST_PAUSE = 1000;
const LONGEST_PAUSE = 30000;

// Calls heard(name, data) for each event called one of `names` after the event with the id `last`.
export function listen(url, last, names, heard, told = () => {}) {
  let source = null;
  let timer = 0;
  let pause = FIRST_PAUSE;

  function close() {
    clearTimeout(timer);
    if (source) source.close();
    source = null;
  }

  function open() {
    close();
    if (document.hidden) return;
    source = new EventSource(`${url}${url.includes("?") ? "&" : "?"}last_event_id=${last}`);
    source.onopen = () => {
      pause = FIRST_PAUSE;
      told(true);
    };
    source.onerror = () => {
      told(false);
      // The browser tries again by itself unless it was turned away (a restart behind a proxy, a log-out).
      if (source.readyState !== EventSource.CLOSED) return;
      timer = setTimeout(open, pause);
      pause = Math.min(pause * 2, LONGEST_PAUSE);
    };
    for (const name of [...names, "reset"]) {
      source.addEventListener(name, (event) => {
        last = event.lastEventId || last;
        heard(name, event.data);
      });
    }
  }

  document.addEventListener("visibilitychange", () => (document.hidden ? close() : open()));
  addEventListener("pagehide", close);
  addEventListener("pageshow", (event) => event.persisted && open());
  open();
}
