// Addresses of pages: everything that leads back to what is shown stands behind the #.

const listeners = new Set();

export function current() {
  const [path, query = ""] = location.hash.replace(/^#\/?/, "").split("?");
  const values = Object.fromEntries(new URLSearchParams(query));
  return { page: path || "overview", ...values };
}

export function address(changes) {
  const { page, ...values } = { ...current(), ...changes };
  const query = new URLSearchParams();
  for (const [name, value] of Object.entries(values)) {
    if (value !== null && value !== undefined && value !== "") query.set(name, value);
  }
  const text = query.toString();
  return `#/${page}${text ? `?${text}` : ""}`;
}

// What holds on all pages: the run, the window of time, and whether rows of ROS itself are shown.
const KEPT = ["run", "start", "end", "internal"];

// The address of another page: of what is shown now, only that remains which holds on all pages.
export function pageAddress(page, values = {}) {
  const known = current();
  const cleared = Object.fromEntries(
    Object.keys(known).filter((name) => !KEPT.includes(name)).map((name) => [name, null]),
  );
  return address({ ...cleared, page, ...values });
}

export function go(changes) {
  location.hash = address(changes);
}

// What changes often (the window while it is moved) leaves no trail in the history.
export function replace(changes) {
  history.replaceState(null, "", address(changes));
}

export function onChange(listener) {
  listeners.add(listener);
}

addEventListener("hashchange", () => {
  for (const listener of listeners) listener();
});
