-- description: The flows that arrived, of one case, with a number each: main.end_to_end_flow of
--     rows of main.end_to_end that are kept in a table. A flow with a stored message has no
--     latency: it is among them only if its take is asked for.
-- grain: one row per flow that reached the sink
-- param: outcomes
-- param: flow_case, sink_take_id, most_flows, at_quantile, path_ids
-- column: flow_id, run_id
-- column: path_id BIGINT  Path, as in these rows
-- column: root_kind, root_id, root_ns, take_id, sink_event, sink_ns, latency_ns, is_ambiguous
CREATE OR REPLACE MACRO main.chosen_flow(
    outcomes, flow_case := 'first', sink_take_id := NULL, most_flows := NULL, at_quantile := NULL,
    path_ids := NULL
) AS TABLE
SELECT
    row_number() OVER (
        ORDER BY e.path_id, e.root_ns, e.root_kind, e.root_id, e.sink_ns, e.take_id
    ) AS flow_id,
    e.run_id, e.path_id, e.root_kind, e.root_id, e.root_ns, e.take_id, e.sink_event, e.sink_ns,
    e.sink_ns - e.root_ns AS latency_ns,
    e.is_ambiguous
FROM query_table(outcomes) AS e
WHERE derive.known_word('flow_case', flow_case, ['first', 'last', 'newest', 'every_pair'])
    AND e.status = 'reached'
    AND CASE WHEN sink_take_id IS NULL THEN e.latency_ns IS NOT NULL
        ELSE e.take_id = sink_take_id END
    AND CASE flow_case
        WHEN 'first' THEN e.is_first
        WHEN 'last' THEN e.is_last
        WHEN 'newest' THEN e.is_newest
        ELSE true
    END
    AND (path_ids IS NULL OR list_contains(path_ids, e.path_id))
-- The quantile is one that occurred: so many flows took no longer.
QUALIFY CASE
    WHEN at_quantile IS NOT NULL THEN row_number() OVER (
        ORDER BY e.latency_ns, e.path_id, e.root_ns, e.root_kind, e.root_id, e.take_id
    ) = greatest(1, ceil(at_quantile * count(e.latency_ns) OVER ()))
    WHEN most_flows IS NOT NULL THEN row_number() OVER (
        ORDER BY e.latency_ns DESC, e.path_id, e.root_ns, e.root_kind, e.root_id,
            e.take_id
    ) <= most_flows
    ELSE true
END
