-- name: derive.clock_bound
-- kind: macro
-- description: What messages and packets say of how far two clocks are apart. Nothing can be
--     received before it was sent. So what was sent to the clock `clock_id` says what has to be
--     added at least to its times to get those of `other_clock_id`; what was sent from it says
--     what at most. The difference is `-sense * bound_ns`: in both directions the largest
--     `bound_ns` tells most.
-- grain: one row per pair of clocks and message or packet between them
CREATE OR REPLACE MACRO derive.clock_bound(only_run) AS TABLE
SELECT
    greatest(from_clock_id, to_clock_id) AS clock_id,
    least(from_clock_id, to_clock_id) AS other_clock_id,
    is_packet,
    CASE WHEN to_clock_id > from_clock_id THEN -1 ELSE 1 END AS sense,
    CASE WHEN to_clock_id > from_clock_id THEN received_ns ELSE sent_ns END AS at_ns,
    sent_ns - received_ns AS bound_ns
FROM derive.clock_way
WHERE run_id = only_run
