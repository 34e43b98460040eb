-- description: Flows between two topics, whatever path they took: rows of main.end_to_end of
--     several paths become rows of one. A root that arrived by any path has arrived, once for each
--     message that reflects it. Another has the status that says most: 'cut_by_recording', then
--     'lost', 'dropped', 'unknown', 'no_output', 'superseded' and 'not_connected'. A doubt about
--     one path only does not make it ambiguous.
-- grain: one row per pair of topics, receiving node, root and take there; one per pair of topics,
--     receiving node and root that did not arrive
-- param: arrivals VARCHAR  Name of rows of run_id, path, first_topic, last_topic, and all columns
--     of main.end_to_end but path_id: a table, or a part of the query
-- column: run_id, first_topic, last_topic
-- column: node VARCHAR [node]  Node that takes it
-- column: root_kind, root_id, root_ns
-- column: take_id BIGINT  Take at the end of the path; NULL: not reached
-- column: sink_ns
-- column: latency_ns BIGINT [ns]  From the start of the root to the end; NULL: it did not arrive,
--     or a message on its way was stored
-- column: status VARCHAR  'reached', or why not, as in main.end_to_end
-- column: is_first, is_last, is_newest
-- column: is_loss_affected BOOLEAN  A gap of a trace overlaps its time
-- column: is_ambiguous BOOLEAN  All its paths pass a link that may be another one
CREATE OR REPLACE MACRO main.end_to_end_between(arrivals) AS TABLE
WITH flow AS (
    SELECT
        *,
        string_split(path, ' → ')[-1] AS node
    FROM query_table(arrivals)
),
united AS (
    SELECT
        run_id, first_topic, last_topic, node, root_kind, root_id, take_id,
        any_value(root_ns) AS root_ns,
        any_value(sink_ns) AS sink_ns,
        max(latency_ns) AS latency_ns,
        arg_min(
            status,
            list_position(
                [
                    'reached', 'cut_by_recording', 'lost', 'dropped', 'unknown', 'no_output',
                    'superseded', 'not_connected'
                ],
                status
            )
        ) AS status,
        bool_or(is_loss_affected) AS is_loss_affected,
        bool_and(is_ambiguous) AS is_ambiguous
    FROM flow
    GROUP BY run_id, first_topic, last_topic, node, root_kind, root_id, take_id
)
SELECT
    run_id, first_topic, last_topic, node, root_kind, root_id, root_ns, take_id, sink_ns,
    latency_ns, status,
    CASE WHEN take_id IS NOT NULL THEN row_number() OVER of_root = 1 END AS is_first,
    CASE WHEN take_id IS NOT NULL THEN row_number() OVER to_root = 1 END AS is_last,
    CASE WHEN take_id IS NOT NULL THEN row_number() OVER of_take = 1 END AS is_newest,
    is_loss_affected, is_ambiguous
FROM united
WINDOW
    root AS (PARTITION BY run_id, first_topic, last_topic, node, root_kind, root_id),
    of_root AS (root ORDER BY sink_ns, take_id),
    to_root AS (root ORDER BY take_id IS NULL, sink_ns DESC, take_id DESC),
    of_take AS (
        PARTITION BY run_id, first_topic, last_topic, node, take_id
        ORDER BY root_ns DESC, root_kind DESC, root_id DESC
    )
-- A root that arrived by one path did not fail by another.
QUALIFY take_id IS NOT NULL OR count(take_id) OVER root = 0
