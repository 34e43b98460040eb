-- description: Bounds of the difference between two clocks, from messages and packets. Nothing is
--     received before it was sent. Hence each of them bounds the difference that turns times of
--     `clock_id` into times of `other_clock_id`. A message to `clock_id` gives a lower bound, a
--     message from it an upper bound. The bound is `-sense * bound_ns`. In both directions the
--     largest `bound_ns` is the tightest.
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
