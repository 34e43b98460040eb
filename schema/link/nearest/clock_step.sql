-- description: When a clock that stamps messages was set, and from which difference to which, by
--     the clock of the trace. Until start_ns its difference is certain, and from end_ns on it is so
--     again; NULL on a side where it never is.
-- grain: one row per clock and step, or steps with nothing certain between them
CREATE OR REPLACE MACRO derive.clock_step(only_run) AS TABLE
WITH line AS (
    SELECT
        run_id, clock_id, difference_ns,
        derive.stamped_ns(start_ns, at_ns, difference_ns, drift_ppb) AS start_ns,
        derive.stamped_ns(end_ns, at_ns, difference_ns, drift_ppb) AS end_ns,
        row_number() OVER (PARTITION BY clock_id ORDER BY at_ns - difference_ns)
            AS position
    FROM store.stamp_clock
    WHERE run_id = only_run
)
SELECT
    coalesce(a.run_id, b.run_id) AS run_id,
    coalesce(a.clock_id, b.clock_id) AS clock_id,
    a.end_ns AS start_ns,
    b.start_ns AS end_ns,
    a.difference_ns AS before_ns,
    b.difference_ns AS behind_ns
FROM line AS a
FULL JOIN line AS b ON a.clock_id = b.clock_id AND a.position + 1 = b.position
WHERE coalesce(a.end_ns, b.start_ns) IS NOT NULL
