-- description: When a clock that stamps messages was set, and from which difference to which. Until
--     start_ns its difference is certain, and from end_ns on it is so again. If it is so on neither
--     side or on one only, all that is known on the other is within the step. A stamp from a step
--     may be by any of the differences that showed.
-- grain: one row per clock and step, or steps with nothing certain between them
CREATE OR REPLACE MACRO derive.clock_step(only_run) AS TABLE
WITH known AS (FROM derive.certain_clock(only_run) WHERE is_known),
turn AS (
    SELECT
        clock_id, segment, at_ns,
        difference_ns AS behind_ns,
        CASE WHEN is_certain THEN start_ns ELSE end_ns END AS end_ns,
        lag(CASE WHEN is_certain THEN end_ns ELSE start_ns END) OVER on_clock AS start_ns,
        lag(segment) OVER on_clock AS before_segment,
        lag(at_ns) OVER on_clock AS before_at_ns,
        lag(difference_ns) OVER on_clock AS before_ns
    FROM (
        FROM known
        WINDOW by_clock AS (PARTITION BY clock_id)
        QUALIFY is_certain OR at_ns IN (min(at_ns) OVER by_clock, max(at_ns) OVER by_clock)
    )
    WINDOW on_clock AS (PARTITION BY clock_id ORDER BY at_ns)
)
SELECT
    only_run::BIGINT AS run_id,
    t.clock_id, t.segment, t.start_ns, t.end_ns, t.before_ns, t.behind_ns,
    list_sort(list_distinct(list(k.difference_ns))) AS differences_ns
FROM turn AS t
JOIN known AS k ON t.clock_id = k.clock_id AND k.at_ns BETWEEN t.before_at_ns AND t.at_ns
WHERE t.segment > t.before_segment
GROUP BY ALL
