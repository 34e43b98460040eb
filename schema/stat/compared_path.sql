-- name: derive.compared_path
-- kind: macro
-- description: End-to-end latencies by path as text, which is the same in other runs of a system.
--     A root counts once, however often it arrived; whether it reached the end is not known of
--     those at the edge of the trace.
-- grain: one row per path, root and arrival; one per path and root that did not arrive
-- param: runs BIGINT[]  Runs to look at
-- param: from_topic VARCHAR  Topic where flows start; every source when NULL
-- param: to_topic VARCHAR  Topic where flows end; wherever they end when NULL
-- param: wanted_case VARCHAR  Arrivals that are measured: 'first', 'last', 'newest', 'every_pair'
-- needs: main.flow_path, main.end_to_end
CREATE OR REPLACE MACRO derive.compared_path(
    runs, from_topic, to_topic, wanted_case
) AS TABLE
SELECT
    e.run_id,
    p.path AS subject,
    false AS is_internal,
    e.root_ns AS at_ns,
    e.root_id AS id,
    CASE
        WHEN e.status <> 'reached' THEN NULL
        WHEN wanted_case = 'first' AND NOT e.is_first THEN NULL
        WHEN wanted_case = 'last' AND NOT e.is_last THEN NULL
        WHEN wanted_case = 'newest' AND NOT e.is_newest THEN NULL
        ELSE e.latency_ns
    END AS value_ns,
    e.is_first AND e.status <> 'edge' AS is_unit,
    e.status = 'reached' AS is_complete
FROM main.end_to_end(
    runs, from_topic, to_topic, 'callback_start', 'callback_end',
    (-9223372036854775808)::BIGINT, 9223372036854775807
) AS e
JOIN main.flow_path(runs, from_topic, to_topic) AS p ON e.path_id = p.path_id
