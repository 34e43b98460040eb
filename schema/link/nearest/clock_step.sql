-- name: derive.clock_step
-- kind: macro
-- description: When a clock that stamps messages was set, and from which difference to which. Until
--     start_ns it was certainly not set yet, from end_ns on it certainly was. A stamp from
--     the time in between may be by any of the differences that showed.
-- grain: one row per clock and step
-- param: only_run BIGINT  Run to look at
-- when: store.stamp_clock
CREATE OR REPLACE MACRO derive.clock_step(only_run) AS TABLE
SELECT
    only_run::BIGINT AS run_id, t.clock_id, t.before_segment, t.segment, t.last_ns AS start_ns,
    t.start_ns AS end_ns, t.before_ns, t.difference_ns AS behind_ns,
    list_sort(list_distinct(list(c.difference_ns))) AS differences_ns
FROM (
    SELECT
        clock_id, segment, start_ns, difference_ns,
        lag(segment) OVER on_clock AS before_segment,
        lag(start_ns) OVER on_clock AS before_start_ns,
        lag(end_ns) OVER on_clock AS last_ns,
        lag(difference_ns) OVER on_clock AS before_ns
    FROM derive.certain_clock(only_run)
    WHERE is_certain
    WINDOW on_clock AS (PARTITION BY clock_id ORDER BY at_ns)
) AS t
JOIN derive.certain_clock(only_run) AS c
    ON t.clock_id = c.clock_id AND c.start_ns BETWEEN t.before_start_ns AND t.start_ns
WHERE t.segment > t.before_segment AND c.is_known
GROUP BY ALL
