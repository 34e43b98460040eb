-- description: Where the difference between the clock that stamps messages and that of the traces
--     is certain. It is so between stretches of time that agree with it: in a stretch beside a
--     step, or before one that is not known, the clock may have been set already. If a single
--     stretch tells nothing, the clock went on between those beside it: it does not jump there and
--     back within a stretch.
-- grain: one row per clock and stretch of time
CREATE OR REPLACE MACRO derive.certain_clock(only_run) AS TABLE
WITH told AS (
    SELECT
        clock_id, at_ns, start_ns, end_ns, segment,
        coalesce(is_sharp, true) AS is_sharp,
        CASE WHEN is_between THEN between_ns ELSE difference_ns END AS difference_ns,
        CASE WHEN is_between THEN between_ppb ELSE drift_ppb END AS drift_ppb,
        message_count > 0 OR is_between AS is_known
    FROM (
        SELECT
            *,
            (lag(difference_ns) OVER on_clock + lead(difference_ns) OVER on_clock) // 2
                AS between_ns,
            (lag(drift_ppb) OVER on_clock + lead(drift_ppb) OVER on_clock) // 2 AS between_ppb,
            message_count = 0 AND coalesce(
                lag(message_count) OVER on_clock > 0
                AND lead(message_count) OVER on_clock > 0
                AND lag(segment) OVER on_clock = lead(segment) OVER on_clock,
                false
            ) AS is_between
        FROM store.stamp_clock
        WHERE run_id = only_run
        WINDOW on_clock AS (PARTITION BY clock_id ORDER BY at_ns)
    )
)
SELECT
    *,
    is_known
    AND coalesce(
        last_value(CASE WHEN is_known THEN segment END IGNORE NULLS) OVER (
            on_clock ROWS BETWEEN UNBOUNDED PRECEDING AND 1 PRECEDING
        ) = segment,
        true
    )
    AND coalesce(lead(is_known) OVER on_clock AND lead(segment) OVER on_clock = segment, true)
        AS is_certain
FROM told
WINDOW on_clock AS (PARTITION BY clock_id ORDER BY at_ns)
