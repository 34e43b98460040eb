// Labels: names that people read, for columns of queries, statistics and kinds.

export const KINDS = [
  "callback instance",
  "publication",
  "take",
  "request",
  "response",
  "wait",
  "select",
  "take and callback",
  "event",
  "blocked",
  "node active",
  "node not active",
  "untaken message",
  "running",
  "preempted",
  "runnable",
  "sleeping",
  "uninterruptible",
  "not known",
];
export const EVENT = 8;
export const BLOCKED = 9;
export const ACTIVE = 10;
export const INACTIVE = 11;
export const MISSING = 12;
// States of threads to the kernel; of a core, what ran there, and who lost it.
export const RUNNING = 13;
export const PREEMPTED = 14;
export const RUNNABLE = 15;
export const SLEEPING = 16;
export const UNINTERRUPTIBLE = 17;
const WAKERS = ["", "a timer", "an interrupt", "a softirq"];
export const wakerName = (flags, name) => WAKERS[(flags >> 4) & 3] || name;

// What the server says where no thread took the CPU.
export const IDLE_CPU = "idle CPU";

// What a thread did in a piece of the critical path.
export function stateText(state, who, wakers) {
  if (wakers) return `waits for ${who}, which is ${state}`;
  switch (state) {
    case "preempted":
      return who === IDLE_CPU
        ? "ready, but without its CPU, which is idle (a quota, or a limit)"
        : `preempted by ${who ?? "?"}`;
    case "runnable":
      return `waits for a CPU${who ? `, woken by ${who}` : ""}`;
    case "sleeping":
      return `sleeps${who ? `, until ${who} wakes it` : ""}`;
    case "uninterruptible":
      return `waits for a page or a disk${who ? `, until ${who} wakes it` : ""}`;
    default:
      return state;
  }
}
export const STATE_COLORS = {
  running: "running",
  preempted: "preempted",
  runnable: "runnable",
  sleeping: "wait",
  uninterruptible: "uninterruptible",
  unknown: "faint",
};
export const KIND_NAMES = ["callback_instance", "publication", "take", "request", "response"];

export const LINKS = {
  transport: "publish to take",
  callback: "take to callback",
  direct: "published by",
  periodic_async: "periodic (cached until the timer)",
  partial_sync: "synchronised (cached until the set was complete)",
  approximate_sync: "synchronised (cached until the closest set was known)",
  queue: "queued (until a thread had worked it off)",
  take_adjacent: "published after the take",
  polled: "taken in the callback, then published",
  service: "service",
};
export const LINK_CODES = [
  "transport",
  "direct",
  "periodic_async",
  "partial_sync",
  "take_adjacent",
  "polled",
  "approximate_sync",
  "queue",
];

const TITLES = {
  run_id: "run",
  roots: "flows",
  loss_affected: "touched by losses",
  ambiguous: "by a link in doubt",
  is_ambiguous: "by a link in doubt",
  sink_event: "ends with",
  is_cut: "search cut",
  what: "what",
  topic_name: "topic",
  service_name: "service",
  action_name: "action",
  is_loss_affected: "touched by losses",
  rate_hz: "rate",
  callback_share: "busy",
  orphans: "takes without publication",
  start_at: "begin",
  length: "duration",
  a_ns: "A",
  b_ns: "B",
  difference_ns: "B − A",
  change_percent: "change",
  low_ns: "95 % interval, from",
  high_ns: "to",
  a_count: "values of A",
  b_count: "values of B",
  share: "share",
  affected_percent: "affected",
  seen_ns: "seen",
  executor_kind: "executor",
  root_at: "began at",
  publisher_count: "publishers",
  subscription_count: "subscriptions",
  publication_count: "messages published",
  take_count: "messages taken",
  delayed_min: "delayed, at least",
  delayed_max: "delayed, at most",
  busy_worst_ns: "busy, longest",
  busy_total_min_ns: "busy in all, at least",
  busy_total_max_ns: "busy in all, at most",
  meanwhile_node: "kept waiting by",
  meanwhile_callback: "its callback",
  meanwhile_thread: "thread that had the CPU",
  running_median_ns: "CPU time, median",
  running_p99_ns: "CPU time, p99",
  cpu_share: "CPU share",
  running_share: "on a CPU",
  waiting_share: "ready, without a CPU",
  run_queue_worst_ns: "run queue, longest",
  preempted_worst_ns: "preempted, longest",
  cpu_taken_by: "CPU taken by",
  overlap_min_ns: "ran meanwhile, at least",
  overlap_max_ns: "ran meanwhile, at most",
  worst_ns: "longest",
  a_share: "share in A",
  b_share: "share in B",
  open: "not seen to end",
  period_deviation_ns: "jitter",
  first_at: "first",
  last_at: "last",
  taken_at: "taken at",
  subscriber: "received by",
  not_taken: "not taken",
  busy_share: "executor busy",
  callback_instance_id: "callback instance",
  request_id: "request",
  take_id: "take",
  usual_ns: "usual median",
  at_ns: "begin in the run",
  value: "value",
  to_open_it: "opens with",
  worst_run: "run with most",
  cure: "what to do",
};

// Parts of a latency, in the words of msgflow/text/parts.py.
const PARTS = {
  network_or_idle: "way or idle",
  until_arrival: "on the way",
  undecided: "way or queue",
  executor_busy: "in the queue",
  all_threads_busy: "waits for a thread",
  blocked: "group is busy",
  executor: "in the executor",
  run_queue: "waits for a CPU",
  request_to_take: "request to its take",
  response_to_take: "answer to its take",
  cache: "in the cache",
  timer: "waits for timer",
  unpublished: "waits for input",
  intra: "publish (intra)",
  rclcpp: "publish (rclcpp)",
  rcl: "publish (rcl)",
  rmw: "publish (rmw)",
  dds: "publish (dds)",
};
export const partTitle = (name) => PARTS[name] ?? name.replaceAll("_", " ");
// Of these colours too light or too dull for the page's own colour as text on them.
export const PALE = new Set(["wait", "faint"]);
export const PART_COLORS = {
  callback: "subscription",
  cache: "indirect",
  take_to_callback: "faint",
  stored: "stored",
  network_or_idle: "transport",
  undecided: "wait",
  until_arrival: "transport",
  run_queue: "runnable",
  executor: "process",
  executor_busy: "process",
  all_threads_busy: "process",
  blocked: "process",
  unpublished: "faint",
  timer: "timer",
  service: "service",
  rclcpp: "publication",
  rcl: "publication",
  rmw: "publication",
  dds: "publication",
  intra: "publication",
  publish: "publication",
  take: "take",
};

// Nodes and topics take turns in a path: a topic with the name of its node is written once.
export const PATH_HELP = "A topic with the name of the node that publishes it is written once.";
export function pathText(path) {
  return String(path ?? "").split(" → ").reduce(
    (text, part, place, parts) =>
      place % 2 && part === parts[place - 1] ? text : place ? `${text} → ${part}` : part,
    "",
  );
}

// What a small curve is scaled to: few outliers, as those of a start, do not press the rest down.
export function usualMost(values) {
  const own = Array.from(values).filter((value) => value > 0).sort((a, b) => a - b);
  return Math.min(own[own.length - 1] ?? 1, 1.25 * (own[Math.floor(own.length * 0.97)] ?? 1));
}

// A word of a command for a shell, as msgflow/text/shell.py writes it.
export function shellQuoted(text) {
  if (/^[\w@%+=:,./-]+$/.test(text)) return text;
  const isPlain = text.includes("'") && !/["$`\\!]/.test(text);
  return isPlain ? `"${text}"` : `'${text.replaceAll("'", "'\\''")}'`;
}

export function title(name) {
  if (name in TITLES) return TITLES[name];
  return name.replace(/_(ns|hz|percent)$/, "").replace(/^p(\d\d)$/, "p$1").replaceAll("_", " ");
}

const UNITS = [[1e9, "s"], [1e6, "ms"], [1e3, "µs"], [1, "ns"]];

// Durations as people say them: at most six digits, exact to the nanosecond where these suffice.
export function duration(ns) {
  if (ns === null || ns === undefined || Number.isNaN(ns)) return "–";
  if (ns === 0) return "0";
  const size = Math.abs(ns);
  const [scale, unit] = UNITS.find(([least]) => size >= least) ?? UNITS[3];
  const value = ns / scale;
  return `${trimmed(value, scale === 1 ? 0 : 3)} ${unit}`;
}

// Three digits are enough beside an arrow.
export function brief(ns) {
  const size = Math.abs(ns);
  const [scale, unit] = UNITS.find(([least]) => size >= least) ?? UNITS[3];
  return `${Number((ns / scale).toPrecision(3)).toLocaleString("en-US")} ${unit}`;
}

function trimmed(value, digits) {
  return value.toLocaleString("en-US", { maximumFractionDigits: digits, useGrouping: true });
}

// Points in time since the begin of the run, all nanoseconds: 12.345 678 901 s.
export function moment(at) {
  if (at === null || at === undefined || Number.isNaN(at)) return "–";
  const negative = at < 0;
  const whole = Math.floor(Math.abs(at) / 1e9);
  const rest = Math.round(Math.abs(at) - whole * 1e9).toString().padStart(9, "0");
  return `${negative ? "−" : ""}${whole}.${rest.slice(0, 3)} ${rest.slice(3, 6)} ${
    rest.slice(6)
  } s`;
}

// A point in time as the command line takes it: seconds, all digits, without those that are zero.
export function secondsText(at) {
  const whole = Math.floor(at / 1e9);
  const rest = Math.round(at - whole * 1e9).toString().padStart(9, "0").replace(/0+$/, "");
  return rest ? `${whole}.${rest}` : String(whole);
}

// At the axis of a chart over time.
export const momentAxis = (at) => `${+(at / 1e9).toFixed(6)} s`;

// What secondsText writes, or a number with another unit, in nanoseconds; undefined: neither.
const SIZES = { "": 1e9, s: 1e9, ms: 1e6, "µs": 1e3, us: 1e3, ns: 1, min: 60e9 };
export function momentOf(text) {
  const found = /^\s*(\d{1,18}(?:\.\d{1,9})?)\s*(|s|ms|µs|us|ns|min)\s*$/.exec(text);
  return found ? Math.round(Number(found[1]) * SIZES[found[2]]) : undefined;
}

export function count(number, thing) {
  return `${number.toLocaleString("en-US")} ${thing}${number === 1 ? "" : "s"}`;
}

export function percent(share, digits = 1) {
  if (share > 0 && share < 0.0005 && digits === 1) return "< 0.1 %";
  return share === null || Number.isNaN(share) ? "–" : `${(100 * share).toFixed(digits)} %`;
}

// A wall-clock time of an offset, in UTC, to the nanosecond.
export function wallClock(originText, at) {
  const ns = BigInt(originText) + BigInt(Math.round(at));
  const seconds = ns / 1000000000n;
  const rest = ns - seconds * 1000000000n;
  const date = new Date(Number(seconds) * 1000);
  if (Number.isNaN(date.getTime())) return "";
  return `${date.toISOString().slice(0, 19)}.${rest.toString().padStart(9, "0")}Z`;
}

export function cell(value, column) {
  if (value === null || value === undefined || (typeof value === "number" && Number.isNaN(value))) {
    return "";
  }
  if (typeof value === "boolean") return value ? "yes" : "no";
  if (Array.isArray(value)) return value.join(", ");
  if (column.unit === "epoch ns" || column.unit === "ns since origin") return moment(value);
  if (column.unit === "ns") return duration(value);
  if (column.unit === "Hz") return `${trimmed(value, 3)} Hz`;
  if (column.unit === "%") return `${trimmed(value, 2)} %`;
  if (column.name === "change_percent") return `${trimmed(value, 2)} %`;
  if (column.name === "part") return partTitle(value);
  if (column.name === "path") return pathText(value);
  if (/^[pt]id$|_id$/.test(column.name)) return String(value);
  if (typeof value === "number") {
    if (/share$/.test(column.name)) return percent(value);
    return trimmed(value, 3);
  }
  return value;
}
