-- name: main.end_to_end_piece
-- kind: macro
-- description: The parts of flows, as in main.end_to_end_part, of which this is the last step.
-- grain: one row per flow and part
-- param: flows VARCHAR  Name of the rows of main.end_to_end_flow: a table, or a part of the query
-- param: trail VARCHAR  Likewise of main.end_to_end_trail
-- param: runs BIGINT[]  Runs that they are of
-- column: run_id BIGINT  Run
-- column: path_id BIGINT  Path, as main.flow_path numbers it for the same arguments
-- column: flow_id BIGINT  Number of the flow in this result
-- column: root_kind VARCHAR  'callback_instance' or 'publication'
-- column: root_id BIGINT  Identity of the root
-- column: take_id BIGINT  Take at the end of the path
-- column: latency_ns BIGINT [ns]  From the start of the root to the end
-- column: hop BIGINT  Number of the message on the path that it belongs or leads to; one more than
--     the last for the callback at the end
-- column: position BIGINT  Order within the flow, from 1
-- column: part VARCHAR  'callback' (from its start, or from the take where none shows, to what it
--     publishes or calls), 'cache' (from the end of the callback to the callback instance that
--     publishes for it),
--     'intra', 'rclcpp', 'rcl', 'rmw', 'dds' (publishing, from this layer to the next), 'publish'
--     (publishing, layer not known), 'publish_to_take' (from its end to the take: the network, an
--     idle executor or a busy one, see main.executor_wait), 'take_to_callback', 'request_to_take'
--     (from the sending of a request), 'service' (from the start of the service callback to what
--     it publishes or calls)
-- column: from_ns BIGINT [epoch ns]  Begin
-- column: to_ns BIGINT [epoch ns]  End
-- column: duration_ns BIGINT [ns]  to_ns - from_ns
-- column: callback_instance_id BIGINT  Callback instance that it is, or that it waits for
-- column: publication_id BIGINT  Message that is published or under way
-- needs: main.publication, main.take, main.callback_instance, main.request, store.flow_call,
--     store.callback_instance, store.link_causal, store.link_request
CREATE OR REPLACE MACRO main.end_to_end_piece(flows, trail, runs) AS TABLE
WITH RECURSIVE flow AS NOT MATERIALIZED (
    SELECT
        flow_id, run_id, path_id, root_kind, root_id, root_ns, take_id, sink_event, sink_ns,
        latency_ns
    FROM query_table(flows)
),
passed AS NOT MATERIALIZED (
    SELECT flow_id, hop, take_id, publication_id, previous_take_id, next_take_id
    FROM query_table(trail)
),
-- Publications to which their own callback did not lead directly: what led to each instead, of the
-- callback instance that the flow came in with.
roundabout AS MATERIALIZED (
    SELECT c.publication_id, c.entered_id, c.publishing_id, c.kind
    FROM (
        SELECT
            publication_id, callback_instance_id AS entered_id,
            callback_instance_id AS publishing_id, kind
        FROM store.link_causal
        WHERE list_contains(runs, run_id) AND kind <> 'direct'
        UNION ALL
        SELECT publication_id, caller_id, callback_instance_id, kind
        FROM store.flow_call
        WHERE list_contains(runs, run_id)
    ) AS c
    ANTI JOIN (
        SELECT publication_id, callback_instance_id
        FROM store.link_causal
        WHERE list_contains(runs, run_id) AND kind = 'direct'
    ) AS d ON c.publication_id = d.publication_id AND c.entered_id = d.callback_instance_id
    SEMI JOIN passed AS h ON c.publication_id = h.publication_id
    WHERE c.entered_id IS NOT NULL
    QUALIFY row_number() OVER (
        PARTITION BY c.publication_id, c.entered_id
        ORDER BY c.publishing_id <> c.entered_id, c.kind <> 'direct', c.publishing_id
    ) = 1
),
-- Calls of services between the two, from the last one back to the first.
leg (publishing_id, caller_id, level, request_id, service_id, sender_id) AS (
    SELECT c.publishing_id, c.entered_id, 1, i.request_id, c.publishing_id, l.callback_instance_id
    FROM (
        SELECT DISTINCT publishing_id, entered_id FROM roundabout WHERE publishing_id <> entered_id
    ) AS c
    JOIN store.callback_instance AS i ON c.publishing_id = i.callback_instance_id
    JOIN store.link_request AS l ON i.request_id = l.request_id
    UNION
    SELECT g.publishing_id, g.caller_id, g.level + 1, i.request_id, g.sender_id,
        l.callback_instance_id
    FROM leg AS g
    JOIN store.callback_instance AS i ON g.sender_id = i.callback_instance_id
    JOIN store.link_request AS l ON i.request_id = l.request_id
    WHERE g.sender_id <> g.caller_id
),
call AS (
    SELECT
        c.publication_id, c.entered_id, g.level, q.sent_ns, q.taken_ns, i.start_ns,
        i.callback_instance_id
    FROM roundabout AS c
    JOIN leg AS g ON c.publishing_id = g.publishing_id AND c.entered_id = g.caller_id
    JOIN main.request AS q ON g.request_id = q.request_id
    JOIN main.callback_instance AS i ON g.service_id = i.callback_instance_id
),
cached AS (
    SELECT
        c.publication_id, c.entered_id, coalesce(i.end_ns, i.start_ns) AS stored_ns,
        s.callback_instance_id, s.start_ns
    FROM roundabout AS c
    JOIN main.callback_instance AS i ON c.publishing_id = i.callback_instance_id
    LEFT JOIN store.link_causal AS d ON c.publication_id = d.publication_id AND d.kind = 'direct'
    LEFT JOIN main.callback_instance AS s ON d.callback_instance_id = s.callback_instance_id
    WHERE c.kind IN ('periodic_async', 'partial_sync')
),
-- The moments at which a part begins. Those of a hop are in the order of `rank`.
detour AS (
    SELECT
        publication_id, entered_id, -3 * level AS rank, 'request_to_take' AS part, sent_ns AS at_ns,
        callback_instance_id, NULL::BIGINT AS about_id
    FROM call
    WHERE sent_ns IS NOT NULL
    UNION ALL
    SELECT
        publication_id, entered_id, 1 - 3 * level, 'take_to_callback', taken_ns,
        callback_instance_id, NULL
    FROM call
    WHERE taken_ns IS NOT NULL
    UNION ALL
    SELECT
        publication_id, entered_id, 2 - 3 * level, 'service', start_ns, callback_instance_id, NULL
    FROM call
    UNION ALL
    SELECT
        publication_id, entered_id, 0, 'cache', stored_ns, callback_instance_id, publication_id
    FROM cached
    UNION ALL
    SELECT publication_id, entered_id, 1, 'callback', start_ns, callback_instance_id, NULL
    FROM cached
    WHERE callback_instance_id IS NOT NULL
),
between AS MATERIALIZED (
    SELECT
        publication_id, entered_id,
        list(
            {
                'at_ns': at_ns, 'rank': rank, 'part': part,
                'callback_instance_id': callback_instance_id, 'publication_id': about_id
            }
            ORDER BY rank
        ) AS moments
    FROM detour
    GROUP BY publication_id, entered_id
),
turn AS MATERIALIZED (
    SELECT h.flow_id, h.hop, w.moments
    FROM passed AS h
    JOIN between AS w ON h.publication_id = w.publication_id
    JOIN flow AS f ON h.flow_id = f.flow_id
    LEFT JOIN store.callback_instance AS i ON h.previous_take_id = i.take_id
    WHERE w.entered_id = CASE
        WHEN h.hop > 1 THEN i.callback_instance_id
        WHEN f.root_kind = 'callback_instance' THEN f.root_id
    END
),
message AS (
    SELECT
        f.run_id, f.path_id, f.flow_id, f.root_kind, f.root_id, f.root_ns, f.take_id,
        f.latency_ns, f.sink_event, f.sink_ns, h.hop, h.publication_id, t.taken_ns,
        i.start_ns AS called_ns, i.callback_instance_id, h.next_take_id IS NULL AS is_end,
        b.start_ns, b.intra_ns, b.rclcpp_ns, b.rcl_ns, b.rmw_ns, b.dds_ns, b.end_ns,
        -- Where the first layer of publishing is not known.
        b.start_ns IS DISTINCT FROM
            least(b.intra_ns, b.rclcpp_ns, b.rcl_ns, b.rmw_ns, b.dds_ns) AS is_vague,
        i.start_ns IS NOT NULL AND (h.next_take_id IS NOT NULL OR f.sink_event <> 'take')
            AS is_called,
        h.next_take_id IS NULL AND f.sink_event = 'callback_end' AS is_finished,
        (b.intra_ns IS NOT NULL)::INTEGER + (b.rclcpp_ns IS NOT NULL)::INTEGER
        + (b.rcl_ns IS NOT NULL)::INTEGER + (b.rmw_ns IS NOT NULL)::INTEGER
        + (b.dds_ns IS NOT NULL)::INTEGER AS layer_count,
        h.hop > 1 OR f.root_kind = 'callback_instance' AS is_entered,
        coalesce(w.moments, []) AS turn
    FROM passed AS h
    JOIN flow AS f ON h.flow_id = f.flow_id
    JOIN main.publication AS b ON h.publication_id = b.publication_id
    JOIN main.take AS t ON h.take_id = t.take_id
    LEFT JOIN main.callback_instance AS i ON h.take_id = i.take_id
    LEFT JOIN turn AS w ON h.flow_id = w.flow_id AND h.hop = w.hop
),
-- A hop begins with the callback (or take without one) of the message before. Its place among the
-- parts of the flow is that of its last layer of publishing.
placed AS (
    SELECT
        run_id, path_id, flow_id, root_kind, root_id, take_id, latency_ns, sink_ns, hop,
        publication_id, taken_ns, called_ns, callback_instance_id, is_end, start_ns, intra_ns,
        rclcpp_ns, rcl_ns, rmw_ns, dds_ns, end_ns, is_vague, is_called, is_finished, turn,
        layer_count, is_entered,
        CASE WHEN hop = 1 THEN root_ns
            ELSE lag(coalesce(called_ns, taken_ns)) OVER in_order END AS entered_ns,
        CASE WHEN hop = 1 THEN root_id ELSE lag(callback_instance_id) OVER in_order END
            AS entered_id,
        sum(
            is_entered::INTEGER + len(turn) + is_vague::INTEGER + layer_count + 1
            + is_called::INTEGER
        ) OVER in_order::BIGINT - 1 - is_called::INTEGER AS place
    FROM message
    WINDOW in_order AS (PARTITION BY flow_id ORDER BY hop)
),
-- The moments at which a part begins: those that any hop may have, then those of its turn. A row of
-- a hop is taken apart only here: to sort a row of each moment takes several times the memory.
slot AS (
    SELECT *, unnest(range(1, 11 + len(turn))) AS slot FROM placed
),
moment AS (
    SELECT
        *,
        CASE slot
            WHEN 1 THEN intra_ns
            WHEN 2 THEN rclcpp_ns
            WHEN 3 THEN rcl_ns
            WHEN 4 THEN rmw_ns
            WHEN 5 THEN dds_ns
            WHEN 6 THEN entered_ns
            WHEN 7 THEN start_ns
            WHEN 8 THEN end_ns
            WHEN 9 THEN taken_ns
            WHEN 10 THEN called_ns
            ELSE turn[slot - 10].at_ns
        END AS at_ns
    FROM slot
    WHERE CASE slot
        WHEN 1 THEN intra_ns IS NOT NULL
        WHEN 2 THEN rclcpp_ns IS NOT NULL
        WHEN 3 THEN rcl_ns IS NOT NULL
        WHEN 4 THEN rmw_ns IS NOT NULL
        WHEN 5 THEN dds_ns IS NOT NULL
        WHEN 6 THEN is_entered
        WHEN 7 THEN is_vague
        WHEN 9 THEN is_called
        WHEN 10 THEN is_finished
        ELSE true
    END
),
-- The layers follow each other in time, everything else in the order of causes.
followed AS (
    SELECT
        run_id, path_id, flow_id, root_kind, root_id, take_id, latency_ns, hop, publication_id,
        callback_instance_id, entered_id, turn, slot, at_ns, place, layer_count, is_vague,
        CASE
            WHEN slot <= 5 THEN coalesce(
                least(
                    CASE WHEN intra_ns > at_ns THEN intra_ns END,
                    CASE
                        WHEN rclcpp_ns > at_ns OR rclcpp_ns = at_ns AND slot < 2 THEN rclcpp_ns
                    END,
                    CASE WHEN rcl_ns > at_ns OR rcl_ns = at_ns AND slot < 3 THEN rcl_ns END,
                    CASE WHEN rmw_ns > at_ns OR rmw_ns = at_ns AND slot < 4 THEN rmw_ns END,
                    CASE WHEN dds_ns > at_ns OR dds_ns = at_ns AND slot < 5 THEN dds_ns END
                ),
                end_ns
            )
            WHEN slot = 6 AND len(turn) > 0 THEN turn[1].at_ns
            WHEN slot = 6 THEN start_ns
            WHEN slot = 7 THEN
                coalesce(least(intra_ns, rclcpp_ns, rcl_ns, rmw_ns, dds_ns), end_ns)
            WHEN slot = 8 THEN taken_ns
            WHEN slot = 9 THEN called_ns
            WHEN slot = 10 THEN sink_ns
            WHEN slot = 10 + len(turn) THEN start_ns
            ELSE turn[slot - 9].at_ns
        END AS to_ns,
        -- Of its layers, how many come before.
        CASE WHEN slot <= 5 THEN
            coalesce((intra_ns < at_ns OR intra_ns = at_ns AND slot > 1)::INTEGER, 0)
            + coalesce((rclcpp_ns < at_ns OR rclcpp_ns = at_ns AND slot > 2)::INTEGER, 0)
            + coalesce((rcl_ns < at_ns OR rcl_ns = at_ns AND slot > 3)::INTEGER, 0)
            + coalesce((rmw_ns < at_ns OR rmw_ns = at_ns AND slot > 4)::INTEGER, 0)
            + coalesce((dds_ns < at_ns)::INTEGER, 0)
        END AS layers_before
    FROM moment
)
SELECT
    run_id,
    path_id,
    flow_id,
    root_kind,
    root_id,
    take_id,
    latency_ns,
    CASE WHEN slot = 10 THEN hop + 1 ELSE hop END AS hop,
    place + CASE
        WHEN slot <= 5 THEN 1 + layers_before - layer_count
        WHEN slot = 6 THEN -layer_count - is_vague::INTEGER - len(turn)
        WHEN slot = 7 THEN -layer_count
        WHEN slot <= 10 THEN slot - 7
        ELSE slot - 10 - layer_count - is_vague::INTEGER - len(turn)
    END AS position,
    CASE WHEN slot > 10 THEN turn[slot - 10].part
        ELSE [
            'intra', 'rclcpp', 'rcl', 'rmw', 'dds', 'callback', 'publish', 'publish_to_take',
            'take_to_callback', 'callback'
        ][slot] END AS part,
    at_ns AS from_ns,
    to_ns,
    to_ns - at_ns AS duration_ns,
    CASE
        WHEN slot = 6 THEN entered_id
        WHEN slot BETWEEN 8 AND 10 THEN callback_instance_id
        WHEN slot > 10 THEN turn[slot - 10].callback_instance_id
    END AS callback_instance_id,
    CASE
        WHEN slot IN (6, 10) THEN NULL
        WHEN slot > 10 THEN turn[slot - 10].publication_id
        ELSE publication_id
    END AS publication_id
FROM followed
