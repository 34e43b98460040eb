-- description: Roots of paths in the time window, and what became of them. One that reached the
--     sink has a row per take there, any other a single row with the reason. Roots are callback
--     instances of timers that published, or publications (always with from_event 'publish'), or
--     takes of messages whose publisher is not traced: these start with their stamp, if its clock
--     is that of the reader, else with the take. A root that ends at a message that was not taken
--     has the status of the message in main.stat_delivery. If the message was taken, the node ended
--     the flow; or the recording cut it: no later message passed the step, and the process was not
--     recorded for longer than any flow of the path took. It also cuts a root whose message has an
--     unknown status where no earlier or no later message passed the step.
--     Paths that look the same, as `paths` tells, are one: a root that arrived by one of them did
--     not fail by another; another one has the status that says most, as main.end_to_end_between.
-- grain: one row per path, root and take at the sink; one per path and root that did not reach it
-- param: runs, from_topic, to_topic, from_event, to_event, window_start_ns, window_end_ns,
--     max_depth, max_paths, chains
-- param: paths VARCHAR = 'alone'  Name of rows of path_id and alike_id, as of main.flow_path; by
--     default every path is alone
-- param: has_calls
-- param: has_gaps BOOLEAN = true  The recording has gaps; false: none is looked up
-- param: has_states BOOLEAN = true  Nodes are managed; false: no state of one is looked up
-- column: run_id, path_id, alike_id, root_kind, root_id, root_ns
-- column: take_id BIGINT  Take at the end of the path; NULL: not reached
-- column: sink_event, sink_ns
-- column: latency_ns BIGINT [ns]  From the start of the root to the end; NULL: it did not arrive,
--     or a message on its way was stored (main.link_transport)
-- column: status VARCHAR  'reached'; 'superseded' (a newer input took its place in a cache);
--     'dropped', 'lost' or 'not_connected', as in main.stat_delivery; 'no_output' (the node did not
--     publish); 'cut_by_recording' (too close to its start or end to know) or 'unknown'
-- column: reason VARCHAR  Why it did not arrive: 'no_output' (a callback ended without any),
--     'node_inactive' (a managed node), 'not_published' (one or the other), 'superseded',
--     'callback_not_finished', or the reason of main.stat_delivery
-- column: is_first, is_last, is_newest
-- column: is_loss_affected BOOLEAN  A gap of a trace overlaps its time, from the root to the end;
--     if it did not arrive, as long as the longest flow of the path took
-- column: is_ambiguous
CREATE OR REPLACE MACRO main.end_to_end(
    runs, from_topic := NULL, to_topic := NULL, from_event := 'callback_start',
    to_event := 'callback_end', window_start_ns := NULL, window_end_ns := NULL, max_depth := 32,
    max_paths := 1000, chains := 'chain_here', paths := 'alone', has_calls := true,
    has_gaps := true, has_states := true
) AS TABLE
WITH RECURSIVE chain_here AS MATERIALIZED (
    FROM main.flow_chain(runs, from_topic, to_topic, max_depth := max_depth, max_paths := max_paths)
),
chain AS NOT MATERIALIZED (
    FROM query_table(chains)
    WHERE derive.known_word('from_event', from_event, ['callback_start', 'publish'])
        AND derive.known_word('to_event', to_event, ['take', 'callback_start', 'callback_end'])
),
alone AS NOT MATERIALIZED (
    SELECT
        path_id,
        path_id AS alike_id
    FROM chain
),
lineage (path_id, prefix_id, depth, parent_path_id) AS (
    SELECT path_id, path_id, depth, parent_path_id FROM chain WHERE is_path
    UNION ALL
    SELECT l.path_id, c.path_id, c.depth, c.parent_path_id
    FROM lineage AS l
    JOIN chain AS c ON l.parent_path_id = c.path_id
),
path AS MATERIALIZED (
    SELECT
        c.*, a.alike_id,
        dense_rank() OVER (ORDER BY c.publisher_id, c.subscription_id, c.route) AS way_id
    FROM chain AS c
    LEFT JOIN query_table(paths) AS a ON c.path_id = a.path_id
    WHERE c.path_id IN (SELECT prefix_id FROM lineage)
),
-- What recursion looks up stays in memory: one number stands for all that a step has to fit.
way AS MATERIALIZED (SELECT DISTINCT way_id, publisher_id, subscription_id, route FROM path),
-- root_key: positive for a callback instance, negative for a publication and, odd, for a take.
root AS MATERIALIZED (
    SELECT
        r.run_id, r.publication_id, r.publisher_id, r.route,
        CASE
            WHEN r.root_kind = 'take' THEN 2 * r.publication_id - 1
            WHEN i.callback_instance_id IS NULL THEN -2 * r.publication_id
            ELSE i.callback_instance_id
        END AS root_key,
        coalesce(i.start_ns, b.start_ns, t.taken_ns - r.before_take_ns) AS root_ns,
        coalesce(b.start_ns, root_ns) AS published_ns
    FROM store.flow_root AS r
    LEFT JOIN main.publication AS b ON r.publication_id = b.publication_id
    LEFT JOIN main.take AS t ON r.root_kind = 'take' AND r.root_id = t.take_id
    LEFT JOIN main.callback_instance AS i
        ON from_event <> 'publish'
        AND r.root_kind = 'callback_instance'
        AND r.root_id = i.callback_instance_id
    WHERE list_contains(runs, r.run_id)
        AND CASE WHEN from_topic IS NULL THEN r.is_source
            ELSE r.publisher_id IN (SELECT publisher_id FROM chain WHERE depth = 1) END
        AND coalesce(root_ns >= window_start_ns, true)
        AND coalesce(root_ns < window_end_ns, true)
),
stored AS MATERIALIZED (SELECT take_id FROM derive.stored_take WHERE list_contains(runs, run_id)),
transport AS NOT MATERIALIZED (
    SELECT
        *,
        take_id IN (SELECT take_id FROM stored) AS is_stored
    FROM derive.flow_transport
    WHERE list_contains(runs, run_id)
),
step AS MATERIALIZED (
    SELECT
        c.take_id AS from_take_id,
        w.way_id, t.take_id, t.is_stored,
        c.is_ambiguous OR t.is_ambiguous AS is_ambiguous
    FROM derive.flow_continuation AS c
    JOIN transport AS t ON c.publication_id = t.publication_id
    JOIN way AS w
        ON t.publisher_id = w.publisher_id
        AND t.subscription_id = w.subscription_id
        AND c.route = w.route
    WHERE list_contains(runs, c.run_id)
),
-- What is so of one step is so of all that it leads to: a stored message says when its reader came,
-- not how long anything took, and a link that may be another one leads to a flow that may be none.
reached (path_id, root_key, take_id, is_stored, is_ambiguous) AS (
    SELECT p.path_id, r.root_key, t.take_id, t.is_stored, t.is_ambiguous
    FROM root AS r
    JOIN transport AS t ON r.publication_id = t.publication_id
    JOIN path AS p
        ON t.publisher_id = p.publisher_id
        AND t.subscription_id = p.subscription_id
        AND r.route = p.route
        AND p.depth = 1
    UNION ALL
    SELECT
        p.path_id, r.root_key, s.take_id,
        bool_or(r.is_stored OR s.is_stored),
        bool_or(r.is_ambiguous OR s.is_ambiguous)
    FROM reached AS r
    JOIN path AS p ON r.path_id = p.parent_path_id
    JOIN step AS s ON r.take_id = s.from_take_id AND p.way_id = s.way_id
    GROUP BY p.path_id, r.root_key, s.take_id
),
arrival AS MATERIALIZED (
    SELECT r.*, p.alike_id, t.taken_ns, i.start_ns, i.end_ns, i.callback_instance_id
    FROM reached AS r
    JOIN path AS p ON r.path_id = p.path_id AND p.is_path
    JOIN main.take AS t ON r.take_id = t.take_id
    LEFT JOIN main.callback_instance AS i ON r.take_id = i.take_id
),
-- Sinks that never show a callback (rclpy, manual takes): their flows end at the take.
sink AS (
    SELECT
        path_id,
        CASE WHEN count(callback_instance_id) = 0 THEN 'take' ELSE to_event END AS sink_event
    FROM arrival
    GROUP BY path_id
),
pair AS MATERIALIZED (
    SELECT
        a.path_id, a.alike_id, a.root_key, a.take_id, a.is_stored, a.is_ambiguous,
        CASE k.sink_event
            WHEN 'take' THEN a.taken_ns
            WHEN 'callback_start' THEN a.start_ns
            ELSE a.end_ns
        END AS sink_ns
    FROM arrival AS a
    JOIN sink AS k ON a.path_id = k.path_id
    WHERE sink_ns IS NOT NULL
),
expected AS MATERIALIZED (
    SELECT
        p.run_id, p.path_id, p.alike_id, r.root_key,
        min(r.root_ns) AS root_ns,
        arg_max(r.publication_id, r.published_ns) AS publication_id
    FROM path AS p
    JOIN root AS r ON p.first_publisher_id = r.publisher_id AND p.first_route = r.route
    WHERE p.is_path
    GROUP BY p.run_id, p.path_id, p.alike_id, r.root_key
),
missing AS MATERIALIZED (
    FROM expected AS e
    ANTI JOIN pair AS a ON e.alike_id = a.alike_id AND e.root_key = a.root_key
),
-- All flows go through here: what is said of a path or of a missing arrival is added at the end.
outcome AS MATERIALIZED (
    SELECT a.*, e.root_ns
    FROM pair AS a
    JOIN expected AS e ON a.path_id = e.path_id AND a.root_key = e.root_key
    UNION ALL BY NAME
    SELECT
        path_id, alike_id, root_key, root_ns,
        false AS is_stored,
        false AS is_ambiguous
    FROM missing
),
longest AS (
    SELECT
        alike_id,
        max(sink_ns - root_ns) AS longest_ns
    FROM outcome
    GROUP BY alike_id
),
-- With time enough for the longest flow it is not the recording that cut a root.
explained AS (
    SELECT
        s.path_id, s.root_key,
        s.is_cut AND coalesce(m.root_ns + l.longest_ns >= s.recorded_until_ns, true) AS may_be_cut,
        CASE WHEN s.is_cached AND NOT may_be_cut THEN 'superseded' ELSE s.reason END AS reason,
        CASE
            WHEN derive.delivery_status(s.reason) <> 'unknown'
                THEN derive.delivery_status(s.reason)
            WHEN may_be_cut THEN 'cut_by_recording'
            WHEN s.is_cached THEN 'superseded'
            WHEN s.reason IN ('no_output', 'node_inactive') THEN 'no_output'
            ELSE 'unknown'
        END AS status
    FROM derive.stuck_root(
        'missing', 'lineage', 'path', 'reached', 'pair', runs, has_calls, has_states
    ) AS s
    JOIN missing AS m ON s.path_id = m.path_id AND s.root_key = m.root_key
    JOIN longest AS l ON m.alike_id = l.alike_id
    QUALIFY row_number() OVER (
        PARTITION BY m.alike_id, s.root_key
        ORDER BY
            list_position(
                [
                    'cut_by_recording', 'lost', 'dropped', 'unknown', 'no_output', 'superseded',
                    'not_connected'
                ],
                status
            ),
            s.path_id
    ) = 1
),
gap AS (
    SELECT
        run_id, start_ns,
        max(end_ns) OVER (
            PARTITION BY run_id ORDER BY start_ns, end_ns ROWS UNBOUNDED PRECEDING
        ) AS covered_until_ns
    FROM main.gap
    WHERE list_contains(runs, run_id)
),
ranked AS (
    SELECT
        o.*, p.run_id,
        coalesce(o.sink_ns, o.root_ns + coalesce(l.longest_ns, 0)) AS until_ns,
        row_number() OVER of_root = 1 AS is_first,
        last_value(o.take_id) OVER (
            of_root ROWS BETWEEN CURRENT ROW AND UNBOUNDED FOLLOWING
        ) = o.take_id AS is_last,
        -- By another of the paths that look the same.
        coalesce(lag(o.take_id) OVER of_root = o.take_id, false) AS is_repeated,
        row_number() OVER (
            PARTITION BY o.alike_id, o.take_id
            ORDER BY o.root_ns DESC, o.root_key DESC, o.is_stored, o.is_ambiguous, o.path_id
        ) = 1 AS is_newest
    FROM outcome AS o
    JOIN longest AS l ON o.alike_id = l.alike_id
    JOIN path AS p ON o.path_id = p.path_id
    WINDOW of_root AS (
        PARTITION BY o.alike_id, o.root_key
        ORDER BY o.sink_ns, o.take_id, o.is_stored, o.is_ambiguous, o.path_id
    )
)
SELECT
    r.run_id, r.path_id, r.alike_id,
    CASE
        WHEN r.root_key > 0 THEN 'callback_instance'
        WHEN r.root_key % 2 = 0 THEN 'publication'
        ELSE 'take'
    END AS root_kind,
    CASE WHEN r.root_key > 0 THEN r.root_key ELSE -r.root_key // 2 END AS root_id,
    r.root_ns, r.take_id,
    CASE WHEN r.take_id IS NOT NULL THEN k.sink_event END AS sink_event,
    r.sink_ns,
    CASE WHEN NOT r.is_stored THEN r.sink_ns - r.root_ns END AS latency_ns,
    coalesce(x.status, 'reached') AS status,
    x.reason,
    CASE WHEN r.take_id IS NOT NULL THEN r.is_first END AS is_first,
    CASE WHEN r.take_id IS NOT NULL THEN r.is_last END AS is_last,
    CASE WHEN r.take_id IS NOT NULL THEN r.is_newest END AS is_newest,
    coalesce(g.covered_until_ns >= r.root_ns, false) AS is_loss_affected,
    r.is_ambiguous
FROM ranked AS r
ASOF LEFT JOIN (FROM gap WHERE has_gaps) AS g ON r.run_id = g.run_id AND r.until_ns >= g.start_ns
LEFT JOIN sink AS k ON r.path_id = k.path_id
LEFT JOIN explained AS x ON r.path_id = x.path_id AND r.root_key = x.root_key
WHERE CASE WHEN r.take_id IS NULL THEN x.status IS NOT NULL ELSE NOT r.is_repeated END
