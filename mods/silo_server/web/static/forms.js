// SPDX-License-Identifier: LGPL-2.1-or-later
// Guards forms before any is shown: a second click sends nothing twice, and what somebody typed into another form
// is not lost without a question.

// The key of a notice is for this page alone: the address that somebody keeps or sends has none.
const shown = new URL(location.href);
if (shown.searchParams.has("said")) {
  shown.searchParams.delete("said");
  history.replaceState(history.state, "", shown);
}

// The server writes times in the zone that this cookie names. The first page has no cookie yet: it is in UTC.
const zone = Intl.DateTimeFormat().resolvedOptions().timeZone;
const cookie = `silo_timezone=${encodeURIComponent(zone || "UTC")}`;
if (!document.cookie.split("; ").includes(cookie)) {
  document.cookie = `${cookie}; path=/; max-age=31536000; samesite=lax`;
  const local = new Intl.DateTimeFormat("sv", { dateStyle: "short", timeStyle: "short" });
  document.addEventListener("DOMContentLoaded", () => {
    for (const time of document.querySelectorAll("time[datetime]")) {
      time.textContent = local.format(new Date(time.dateTime));
    }
    for (const name of document.querySelectorAll(".zone")) name.textContent = zone || "UTC";
  });
}

// "/" goes to the search of the page, as on many pages of others; never while somebody types.
document.addEventListener("keydown", (event) => {
  const typing = event.target.closest?.("input, select, textarea, [contenteditable]");
  const field = document.querySelector('input[type="search"]');
  if (event.key !== "/" || event.ctrlKey || event.metaKey || event.altKey || typing || !field) return;
  event.preventDefault();
  field.focus();
  field.select();
});

const PATIENCE = 10000; // so long a form that was sent waits for its answer
let sent = null;
let given_up = null;

function changed(field) {
  if (field.type === "hidden" || field.type === "submit") return false;
  if (field.type === "checkbox" || field.type === "radio") return field.checked !== field.defaultChecked;
  if (field.type === "file") return field.files.length > 0;
  if (field.options) {
    const first = Math.max(0, [...field.options].findIndex((option) => option.defaultSelected));
    return field.options.length > 0 && field.selectedIndex !== first;
  }
  return "defaultValue" in field && field.value !== field.defaultValue;
}

// A form that the server refused shows what was typed as if it had always stood there.
const unsaved = (form) =>
  form.method === "post" && (form.dataset.unsaved !== undefined || [...form.elements].some(changed));

document.addEventListener("submit", (event) => {
  const form = event.target;
  if (event.defaultPrevented || form.method !== "post") return;
  if (form === sent) return event.preventDefault();
  sent = form;
  setTimeout(() => (sent = null), PATIENCE);
});

// "Cancel" means it.
document.addEventListener("click", (event) => {
  given_up = event.target.closest("a[data-cancel]")?.closest("form") ?? null;
});

addEventListener("beforeunload", (event) => {
  if (![...document.forms].some((form) => form !== sent && form !== given_up && unsaved(form))) return;
  event.preventDefault(); // the browser asks
  setTimeout(() => (sent = null)); // the person stays
});

addEventListener("pageshow", () => (sent = null));
