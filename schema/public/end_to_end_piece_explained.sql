-- description: The parts of flows (main.end_to_end_piece), with the callback of each, and how long
--     the executor was busy with other callbacks while the message waited. A parameter gives the
--     callback instances, so that they need not be looked up for each part.
-- grain: one row per flow and part
-- param: flows, trail
-- param: callbacks VARCHAR  Likewise of all callback instances of these runs:
--     callback_instance_id, callback_id, take_id, start_ns and end_ns of main.callback_instance,
--     busy_min_ns and busy_max_ns of main.executor_wait (NULL: not known)
-- param: runs
-- param: has_turns BOOLEAN = true  Flows may lead through caches, services or jobs; false: none
--     does
-- column: run_id, path_id, flow_id, root_kind, root_id, take_id, latency_ns
-- column: hop BIGINT  Number of the message on the path that it belongs or leads to; one more than
--     the last for the callback at the end
-- column: position
-- column: rank BIGINT  Order within the hop, from 1
-- column: part, from_ns, to_ns, duration_ns, callback_instance_id
-- column: publication_id BIGINT  Message that is published or under way
-- column: callback_id
-- column: busy_min_ns BIGINT [ns]  Least time for which its executor was busy with other callbacks
--     while a message or request waited
-- column: busy_max_ns BIGINT [ns]  Most time
-- column: is_turning BOOLEAN  The hop leads through a cache, a service or a job: a part may occur
--     twice
CREATE OR REPLACE MACRO main.end_to_end_piece_explained(
    flows, trail, callbacks, runs, has_turns := true
) AS TABLE
WITH RECURSIVE flow AS NOT MATERIALIZED (FROM query_table(flows)),
passed AS NOT MATERIALIZED (FROM query_table(trail)),
callback AS NOT MATERIALIZED (FROM query_table(callbacks)),
-- Publications that were not caused directly by the callback instance by which a flow came in: what
-- caused them at the end of the calls; where nothing was called, that callback instance itself.
roundabout AS MATERIALIZED (
    SELECT c.publication_id, c.entered_id, c.publishing_id, c.publishing_key, c.kind
    FROM (
        SELECT
            publication_id,
            callback_instance_id AS entered_id,
            callback_instance_id AS publishing_id,
            derive.vertex_key('callback_instance', callback_instance_id) AS publishing_key,
            kind
        FROM store.link_causal
        WHERE list_contains(runs, run_id) AND kind <> 'direct'
        UNION ALL
        SELECT
            publication_id, caller_id, callback_instance_id,
            coalesce(
                derive.vertex_key('callback_instance', callback_instance_id),
                derive.vertex_key('request', taken_request_id),
                derive.vertex_key('response', taken_response_id)
            ),
            kind
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
        ORDER BY
            c.publishing_key <> derive.vertex_key('callback_instance', c.entered_id),
            c.kind <> 'direct',
            c.publishing_key
    ) = 1
),
-- The request that each thing came from, and what sent it.
origin AS MATERIALIZED (
    SELECT a.called_key, a.request_id, s.sender_key
    FROM (
        SELECT
            derive.vertex_key('callback_instance', callback_instance_id) AS called_key,
            request_id
        FROM store.callback_instance
        WHERE list_contains(runs, run_id) AND request_id IS NOT NULL
        UNION ALL
        SELECT
            derive.vertex_key('request', request_id),
            request_id
        FROM store.request
        WHERE list_contains(runs, run_id)
        UNION ALL
        SELECT
            derive.vertex_key('response', response_id),
            request_id
        FROM store.response
        WHERE list_contains(runs, run_id)
    ) AS a
    JOIN derive.request_sender AS s ON a.request_id = s.request_id
),
-- Calls of services between the caller and what published, from the last one back to the first.
leg (publishing_key, caller_id, level, request_id, called_key, sender_key) AS (
    SELECT c.publishing_key, c.entered_id, 1, o.request_id, o.called_key, o.sender_key
    FROM (
        SELECT DISTINCT publishing_key, entered_id
        FROM roundabout
        WHERE publishing_key <> derive.vertex_key('callback_instance', entered_id)
    ) AS c
    JOIN origin AS o ON c.publishing_key = o.called_key
    UNION
    SELECT
        g.publishing_key, g.caller_id,
        g.level + 1,
        o.request_id, o.called_key, o.sender_key
    FROM leg AS g
    JOIN origin AS o ON g.sender_key = o.called_key
    WHERE g.sender_key <> derive.vertex_key('callback_instance', g.caller_id)
),
-- A call, and its response if that is what led on. Where no callback is traced, the service works
-- from its take on; where nothing of it is traced, from the sending on.
call AS (
    SELECT
        c.publication_id, c.entered_id, g.level, q.sent_ns, q.taken_ns,
        coalesce(i.start_ns, q.taken_ns, q.sent_ns) AS start_ns,
        r.sent_ns AS answered_ns,
        CASE WHEN derive.vertex_kind(g.called_key) = 'response' THEN r.taken_ns END
            AS returned_ns,
        i.callback_instance_id, i.callback_id, i.busy_min_ns, i.busy_max_ns
    FROM roundabout AS c
    JOIN leg AS g ON c.publishing_key = g.publishing_key AND c.entered_id = g.caller_id
    JOIN main.request AS q ON g.request_id = q.request_id
    LEFT JOIN main.response AS r ON g.called_key = derive.vertex_key('response', r.response_id)
    LEFT JOIN callback AS i
        ON CASE WHEN derive.vertex_kind(g.called_key) = 'callback_instance'
            THEN g.called_key // 8 ELSE coalesce(r.callback_instance_id, q.callback_instance_id)
        END = i.callback_instance_id
),
-- What a callback of Python has a thread of no executor do.
job AS (
    SELECT b.publication_id, s.callback_instance_id, s.continues_id
    FROM store.publication AS b
    SEMI JOIN passed AS h ON b.publication_id = h.publication_id
    ASOF JOIN (
        FROM store.callback_instance
        WHERE continues_id IS NOT NULL AND list_contains(runs, run_id)
            AND thread_id NOT IN (SELECT thread_id FROM store.executor_thread)
    ) AS s ON b.thread_id = s.thread_id AND b.start_ns >= s.start_ns
    WHERE coalesce(b.start_ns <= s.end_ns, true)
),
cached AS (
    SELECT
        c.publication_id, c.entered_id,
        coalesce(i.end_ns, i.start_ns) AS stored_ns,
        s.callback_instance_id, s.callback_id, s.start_ns
    FROM roundabout AS c
    JOIN callback AS i ON c.publishing_id = i.callback_instance_id
    LEFT JOIN store.link_causal AS d ON c.publication_id = d.publication_id AND d.kind = 'direct'
    LEFT JOIN callback AS s ON d.callback_instance_id = s.callback_instance_id
    WHERE derive.is_indirect(c.kind)
),
-- The moments at which a part begins, in the order of causes. A cache comes after all calls.
between AS MATERIALIZED (
    SELECT
        publication_id, entered_id,
        list_filter(
            flatten(list(moments ORDER BY level DESC)), lambda moment: moment.at_ns IS NOT NULL
        ) AS moments
    FROM (
        SELECT
            publication_id, entered_id, level,
            [
                derive.moment(
                    'request_to_take',
                    CASE WHEN taken_ns IS NOT NULL OR callback_instance_id IS NOT NULL
                        THEN sent_ns END,
                    NULL, callback_instance_id, callback_id, busy_min_ns, busy_max_ns
                ),
                derive.moment(
                    'take_to_callback',
                    CASE WHEN callback_instance_id IS NOT NULL THEN taken_ns END, NULL,
                    callback_instance_id, callback_id
                ),
                derive.moment('service', start_ns, NULL, callback_instance_id, callback_id),
                derive.moment('response_to_take', answered_ns),
                derive.moment('callback', returned_ns)
            ] AS moments
        FROM call
        UNION ALL
        SELECT
            publication_id, entered_id, 0,
            [
                derive.moment(
                    'cache', stored_ns, publication_id, callback_instance_id, callback_id
                ),
                derive.moment('callback', start_ns, NULL, callback_instance_id, callback_id)
            ]
        FROM cached
        UNION ALL
        SELECT
            j.publication_id, j.continues_id, 0,
            [
                derive.moment(
                    'take_to_callback', CASE WHEN e.end_ns < i.start_ns THEN e.end_ns END, NULL,
                    i.callback_instance_id, i.callback_id
                ),
                derive.moment('callback', i.start_ns, NULL, i.callback_instance_id, i.callback_id)
            ]
        FROM job AS j
        JOIN callback AS i ON j.callback_instance_id = i.callback_instance_id
        LEFT JOIN callback AS e ON j.continues_id = e.callback_instance_id
    )
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
-- A hop begins with the callback (or take without one) of the message before.
message AS (
    SELECT
        f.run_id, f.path_id, f.flow_id, f.root_kind, f.root_id, f.take_id, f.latency_ns, f.sink_ns,
        h.hop, b.publication_id, t.taken_ns,
        i.start_ns AS called_ns,
        i.callback_instance_id, i.callback_id, i.busy_min_ns, i.busy_max_ns, b.start_ns, b.intra_ns,
        b.rclcpp_ns, b.rcl_ns, b.rmw_ns, b.dds_ns,
        coalesce(b.end_ns, f.root_ns) AS end_ns,
        -- Where the first layer of publishing is not known.
        b.start_ns IS DISTINCT FROM least(b.intra_ns, b.rclcpp_ns, b.rcl_ns, b.rmw_ns, b.dds_ns)
            AS is_vague,
        -- No event shows when the last layer ends, unless the publication has a later one: the
        -- message is written after it.
        len(list_filter(
            [b.intra_ns, b.rclcpp_ns, b.rcl_ns, b.rmw_ns, b.dds_ns],
            lambda layer_ns: layer_ns < b.end_ns
        )) AS layer_count,
        h.hop > 1 OR f.root_kind = 'callback_instance' AS is_entered,
        CASE WHEN h.hop = 1 THEN f.root_ns ELSE coalesce(p.start_ns, u.taken_ns) END AS entered_ns,
        CASE WHEN h.hop = 1 THEN f.root_id ELSE p.callback_instance_id END AS entered_id,
        CASE WHEN h.hop = 1 THEN r.callback_id ELSE p.callback_id END AS entered_callback_id,
        i.start_ns IS NOT NULL AND (h.next_take_id IS NOT NULL OR f.sink_event <> 'take')
            AS is_called,
        h.next_take_id IS NULL AND f.sink_event = 'callback_end' AS is_finished,
        z.created_ns AS subscribed_ns,
        coalesce(w.moments, []) AS turn
    FROM passed AS h
    JOIN flow AS f ON h.flow_id = f.flow_id
    LEFT JOIN main.publication AS b ON h.publication_id = b.publication_id
    JOIN main.take AS t ON h.take_id = t.take_id
    LEFT JOIN callback AS i ON h.take_id = i.take_id
    LEFT JOIN main.take AS u ON h.previous_take_id = u.take_id
    LEFT JOIN callback AS p ON h.previous_take_id = p.take_id
    LEFT JOIN callback AS r
        ON f.root_id = r.callback_instance_id AND f.root_kind = 'callback_instance'
    LEFT JOIN (FROM turn WHERE has_turns) AS w ON h.flow_id = w.flow_id AND h.hop = w.hop
    LEFT JOIN derive.stored_take AS z ON h.take_id = z.take_id
),
-- A list of all parts would be most of the memory of what is sorted here: it comes behind.
placed AS (
    SELECT
        *,
        -- How many parts of its flow come before.
        (sum(parts) OVER (PARTITION BY flow_id ORDER BY hop))::BIGINT - parts AS place
    FROM (
        SELECT
            *,
            is_entered::INTEGER + len(turn) + is_vague::INTEGER + layer_count
            + (subscribed_ns IS NOT NULL)::INTEGER + 1 + is_called::INTEGER AS parts
        FROM message
    )
),
-- The layers follow each other in time, everything else in the order of causes.
begun AS (
    SELECT
        *,
        len(turn) > 0 AS is_turning,
        list_filter(
            [
                derive.moment(
                    'callback', CASE WHEN is_entered THEN entered_ns END, NULL, entered_id,
                    entered_callback_id
                )
            ]
            || turn
            || [derive.moment('publish', CASE WHEN is_vague THEN start_ns END, publication_id)]
            || list_sort(list_filter(
                [
                    derive.moment('intra', intra_ns, publication_id),
                    derive.moment('rclcpp', rclcpp_ns, publication_id),
                    derive.moment('rcl', rcl_ns, publication_id),
                    derive.moment('rmw', rmw_ns, publication_id),
                    derive.moment('dds', dds_ns, publication_id)
                ],
                lambda layer: layer.at_ns < end_ns
            ))
            || [
                derive.moment(
                    'stored', CASE WHEN subscribed_ns IS NOT NULL THEN end_ns END, publication_id
                ),
                derive.moment(
                    'publish_to_take', coalesce(subscribed_ns, end_ns), publication_id,
                    callback_instance_id, callback_id, busy_min_ns, busy_max_ns
                ),
                derive.moment(
                    'take_to_callback', CASE WHEN is_called THEN taken_ns END, publication_id,
                    callback_instance_id, callback_id
                ),
                derive.moment(
                    'callback', CASE WHEN is_finished THEN called_ns END, NULL,
                    callback_instance_id, callback_id
                )
            ],
            lambda moment: moment.at_ns IS NOT NULL
        ) AS moments,
        CASE WHEN is_finished THEN sink_ns WHEN is_called THEN called_ns ELSE taken_ns END
            AS until_ns
    FROM placed
),
part AS (
    SELECT
        *,
        unnest(moments) AS moment,
        unnest(moments[2:] || [NULL]) AS next,
        unnest(range(1, len(moments) + 1)) AS number
    FROM begun
)
-- The callback at the end of a flow is a hop of its own.
SELECT
    run_id, path_id, flow_id, root_kind, root_id, take_id, latency_ns,
    hop + (number > parts)::INTEGER AS hop,
    place + number AS position,
    CASE WHEN number > parts THEN 1 ELSE number END AS rank,
    moment.part,
    moment.at_ns AS from_ns,
    coalesce(next.at_ns, until_ns) AS to_ns,
    to_ns - from_ns AS duration_ns,
    moment.callback_instance_id, moment.publication_id, moment.callback_id, moment.busy_min_ns,
    moment.busy_max_ns,
    is_turning AND number <= parts AS is_turning
FROM part
