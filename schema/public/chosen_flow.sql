-- name: main.chosen_flow
-- kind: macro
-- description: The flows that arrived, of one case, with a number each: main.end_to_end_flow of
--     rows of main.end_to_end that are kept in a table. A flow with a stored message has no
--     latency: it is among them only if its take is asked for.
-- grain: one row per flow that reached the sink
-- param: outcomes VARCHAR  Name of a table with the rows of main.end_to_end
-- param: flow_case VARCHAR = 'first'  Pairs of root and arrival: 'first', 'last', 'newest', or
--     'every_pair'
-- param: sink_take_id BIGINT = NULL  Only flows that end with this take
-- param: most_flows INTEGER = NULL  How many of these, the slowest first; NULL: all
-- param: at_quantile DOUBLE = NULL  In their place the flow with this quantile of the latency,
--     0 to 1
-- param: path_ids BIGINT[] = NULL  Only these paths; NULL: all
-- column: flow_id BIGINT  Number of the flow in this result
-- column: run_id BIGINT  Run
-- column: path_id BIGINT  Path, as in these rows
-- column: root_kind VARCHAR  'callback_instance', 'publication' or 'take'
-- column: root_id BIGINT  Identity of the root
-- column: root_ns BIGINT [epoch ns]  Start of the root
-- column: take_id BIGINT  Take at the end of the path
-- column: sink_event VARCHAR  Event that ended the flow, as in main.end_to_end
-- column: sink_ns BIGINT [epoch ns]  End of the flow
-- column: latency_ns BIGINT [ns]  From the start of the root to the end
-- column: is_ambiguous BOOLEAN  It passes a link that may be another one, as in main.end_to_end
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
