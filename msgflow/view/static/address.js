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
