-- name: recorded_window
-- title: A window on the clocks of the hosts
-- description: The times between which every clock of the run shows something of a window: what
--     lies outside on all of them need not be read.
-- grain: one row per run
-- param: run BIGINT  Run
-- param: start_ns BIGINT  Begin of the window, epoch ns
-- param: end_ns BIGINT  Its end, epoch ns
-- column: recorded_from_ns BIGINT [epoch ns]  Earliest begin on any clock
-- column: recorded_before_ns BIGINT [epoch ns]  Latest end on any clock
SELECT
    -- A drift is undone with rounding.
    min(derive.recorded_ns($start_ns, offset_ns, drift_ppb, reference_ns)) - 2
        AS recorded_from_ns,
    max(derive.recorded_ns($end_ns, offset_ns, drift_ppb, reference_ns)) + 2
        AS recorded_before_ns
FROM main.clock
WHERE run_id = $run
ORDER BY ALL
