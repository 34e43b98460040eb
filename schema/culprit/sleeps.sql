-- title: A callback that sleeps
-- description: Its thread sleeps most of the time that it takes. Without a kernel trace, that may
--     include waits for a CPU after it was woken.
-- grain: one row per node and callback
-- reads: callback_wake
-- next: query callbacks --each --slowest 5 --node {node}
SELECT
    7 AS place,
    c.*,
    c.sleeping_ns / c.measured_ns AS share,
    w.kind AS woken_by,
    NOT $has_kernel AS is_supposed
FROM long_callback AS c
LEFT JOIN callback_wake AS w ON c.node = w.node AND c.callback = w.callback
WHERE c.sleeping_ns > 0.5 * c.measured_ns
