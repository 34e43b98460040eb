-- title: The clock of a host was set while recording
-- description: The clock that stamps messages stepped against the clock of the trace by more than
--     100 ms. Matching by equal stamps is not affected. Latencies measured by stamps are. Where
--     messages are matched by time, the finding clock_set says so.
-- cause: NTP or a user set the clock of the host (the trace follows a clock that cannot be set).
-- cure: Let the clock settle before recording (chronyc waitsync), and slew instead of step.
-- grain: one row per host
-- severity: warning
WITH step AS (
    SELECT
        run_id, host_id,
        shift_ns - lag(shift_ns) OVER (PARTITION BY host_id ORDER BY from_ns) AS step_ns
    FROM derive.stamp_shift
    WHERE host_id NOT IN (
        SELECT h.host_id
        FROM store.host AS h
        JOIN store.stamp_clock AS c ON h.clock_id = c.clock_id
    )
)
SELECT
    run_id, host_id,
    count(*) AS count,
    printf(
        '%s, the largest %.3f %s',
        derive.counted(count(*), 'jump'),
        CASE
            WHEN max(abs(step_ns)) < 1_000_000_000 THEN max(abs(step_ns)) / 1e6
            ELSE max(abs(step_ns)) / 1e9
        END,
        CASE WHEN max(abs(step_ns)) < 1_000_000_000 THEN 'ms' ELSE 's' END
    ) AS detail
FROM step
-- A clock that is slewed moves by 5 ms in ten seconds (adjtime: 500 ppm); the rest is for stamps of
-- threads that had to wait for the CPU.
WHERE abs(step_ns) > 100_000_000
GROUP BY run_id, host_id
